// Elements from text and numbers: nothing that a plan says is ever read as HTML.

const svgTags = new Set(['svg', 'path', 'rect', 'g', 'line', 'circle', 'text', 'title', 'pattern', 'defs']);

export function make(tag, attributes = {}, ...children) {
    const element = svgTags.has(tag) && !(tag === 'title' && attributes.html)
        ? document.createElementNS('http://www.w3.org/2000/svg', tag)
        : document.createElement(tag);
    for (const [key, value] of Object.entries(attributes)) {
        if (value === undefined || value === null || value === false) continue;
        if (key.startsWith('on')) element.addEventListener(key.slice(2), value);
        else element.setAttribute(key, value === true ? '' : value);
    }
    for (const child of children.flat(Infinity)) if (child !== null && child !== undefined) element.append(child);
    return element;
}

// A number with at most so many decimals, without trailing zeros.
export function figure(value, decimals = 2) {
    if (value === null || value === undefined || !Number.isFinite(value)) return '–';
    const rounded = Number(value.toFixed(decimals));
    return rounded.toLocaleString('en-GB', {maximumFractionDigits: decimals}).replaceAll(',', ' ');
}

export function duration(minutes) {
    if (minutes < 1) return `${Math.round(minutes * 60)} s`;
    const total = Math.round(minutes);
    if (total < 60) return `${total} min`;
    return `${Math.floor(total / 60)} h ${String(total % 60).padStart(2, '0')} min`;
}

export function plural(count, one, many = one + 's') {
    return `${figure(count, 0)} ${count === 1 ? one : many}`;
}

export function words(text) {
    return text.replaceAll('_', ' ');
}

// The measures of a form beside its diameter: the corner of a bull-nose or a tapered ball, angles of flank and point.
export function formOf(tool) {
    return (tool.corner_radius ? ` R${figure(tool.corner_radius, 3)}` : '') + (tool.taper_deg ? ` ${figure(tool.taper_deg, 2)}°` : '') + (tool.point_deg ? ` ${figure(tool.point_deg, 1)}°` : '');
}

// What kind of cutter a tool is, with them.
export function cutterOf(tool) {
    return words(tool.kind) + formOf(tool);
}

export function bytesOf(text) {
    const binary = atob(text);
    const bytes = new Uint8Array(binary.length);
    for (let i = 0; i < bytes.length; ++i) bytes[i] = binary.charCodeAt(i);
    return bytes;
}
