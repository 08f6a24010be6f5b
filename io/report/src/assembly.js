// The page of a sheets folder: the stack with its sheets pulled apart, the order of assembly, what to cut, and each sheet's nest.

import {duration, figure, make, plural} from './dom.js';

const {sheets, verify, ways} = JSON.parse(document.getElementById('slabwright-data').textContent);
const part = id => document.getElementById(id);
const programOf = new Map(sheets.programs.map((program, i) => [program.file, i]));
const nameOf = file => file.replace(/^nc\//, '').replace(/\.ngc$/, '');

// Ways of a piece in the part's frame: [[x, y, …] at the sheet's top, the same at its bottom], outlines and holes, the first pass of each.
function ringsOf(piece) {
    const back = ([x, y]) => {
        const u = x - piece.x, v = y - piece.y;
        return piece.turn === 90 ? [v, -u] : piece.turn === 180 ? [-u, -v] : piece.turn === 270 ? [-v, u] : [u, v];
    };
    const pairs = flat => Array.from({length: flat.length / 2}, (_, i) => back([flat[2 * i] / 100, flat[2 * i + 1] / 100]));
    return ways[programOf.get(piece.program)].filter(way => way.piece === piece.number && way.pass === 0)
        .map(way => ({hole: way.hole, top: pairs(way.top), bottom: pairs(way.bottom)}));
}

function table(caption, head, rows, numeric) {
    const tone = i => numeric.includes(i) ? 'n' : null;
    return make('div', {class: 'card scroll'}, make('table', {}, make('caption', {}, caption),
        make('thead', {}, make('tr', {}, head.map((h, i) => make('th', {scope: 'col', class: tone(i)}, h)))),
        make('tbody', {}, rows.map(row => make('tr', {}, row.map((cell, i) => make('td', {class: tone(i)}, cell)))))));
}

function buildSummary(section) {
    const tone = verify.passed ? 'yes' : 'no', volume = 100 * (verify.made_mm3 / verify.part_mm3 - 1);
    const fact = (name, value, small) => make('div', {}, make('dt', {}, name), make('dd', {}, value, small ? make('small', {}, small) : null));
    const {totals} = sheets;
    const joint = sheets.weakest_joint;
    section.append(make('div', {class: 'grid'},
        make('div', {class: `card verdict ${tone}`}, make('p', {class: 'question'}, 'Do the programs make the part?'),
            make('p', {class: 'answer'}, verify.passed ? 'Yes' : 'No'),
            make('p', {}, `Deepest cut into it ${figure(verify.gouge_mm, 3)} mm, most left over ${figure(verify.left_over_mm, 3)} mm, volume ${volume >= 0 ? '+' : ''}${figure(volume, 2)} %.`),
            make('ul', {class: 'reasons'}, verify.violations.slice(0, 8).map(v => make('li', {class: 'error'}, v.message)),
                sheets.diagnostics.filter(d => d.severity !== 'note').slice(0, 8).map(d => make('li', {}, d.message)))),
        make('div', {class: 'card time'}, make('p', {class: 'big'}, `${plural(totals.sheets, 'sheet')}, ${duration(totals.minutes)} of cutting`),
            make('p', {}, `${sheets.input.file}, ${figure(sheets.height)} mm high, stacked along ${sheets.axis.toUpperCase()}; ${sheets.strategy} slicing, ${sheets.head}`
                + `${sheets.most_tilt_deg > 0 ? `, head leans up to ${figure(sheets.most_tilt_deg)}°` : ', upright cuts'}.`),
            make('p', {}, sheets.alignment === 'none' ? 'Nothing but the glue holds the sheets in place while they are bonded.'
                : `Held by ${{tabs: 'tabs with rods', holes: 'rods', dowels: 'dowels'}[sheets.alignment]} of ${figure(sheets.dowel)} mm; ${plural(verify.islands, 'island')} held by nothing.`)),
        make('dl', {class: 'figures'},
            fact('Stock sheets', figure(totals.stock_sheets, 0), sheets.thicknesses.map(t => `${figure(t)} mm`).join(', ')),
            fact('Of the thinnest alone', figure(totals.uniform_sheets, 0), 'sheets'),
            fact('Cut', `${figure(totals.cut_mm / 1000, 1)} m`),
            fact('Left on top', `${figure(totals.left_on_top, 3)} mm`),
            joint ? fact('Weakest joint', `${joint.below} | ${joint.above}`, `${figure(joint.area_mm2, 0)} mm²${joint.bears_n ? `, bears ${figure(joint.bears_n / 1000, 1)} kN` : ''}`) : null)));
    if (sheets.ways.length > 1 || sheets.ways[0].way !== 'planned')
        section.append(table('Ways to make it', ['Way', 'Sheets', 'Stock', 'Cut, m', 'Minutes', 'Off by, mm', 'Part, kg', 'Stock, kg', 'Money'],
            sheets.ways.map(w => w.why_not ? [w.way, w.why_not, '', '', '', '', '', '', ''] : [w.way, w.sheets, w.stock_sheets, figure(w.cut_mm / 1000, 1), figure(w.minutes, 1), figure(w.deviation, 3),
                figure(w.part_kg), figure(w.stock_kg), w.money ? figure(w.money) : '–']), [1, 2, 3, 4, 5, 6, 7, 8]));
}

// Sheets one over the other hide only what is below them, so painting from below is right from any side above.
function buildStack(section) {
    const pieces = sheets.pieces.map(piece => ({...piece, rings: ringsOf(piece)}));
    const canvas = make('canvas', {class: 'apart-view', role: 'img', tabindex: '0', 'aria-label': `The stack of ${pieces.length} sheets, pulled apart. Arrow keys turn it.`});
    const slider = (label, min, max, value) => {
        const input = make('input', {type: 'range', min, max, value, step: 'any'});
        input.addEventListener('input', draw);
        return [input, make('label', {}, label, input)];
    };
    const [gap, gapLabel] = slider('Pull apart', 0, 100, 35), [turn, turnLabel] = slider('Turn', -180, 180, -35), [tilt, tiltLabel] = slider('Look down', 8, 85, 28);
    const [upTo, upToLabel] = slider('Sheets', 1, pieces.length, pieces.length);
    upTo.setAttribute('step', '1');
    section.append(make('div', {class: 'card'}, make('div', {class: 'apart'}, gapLabel, turnLabel, tiltLabel, upToLabel), canvas,
        make('p', {class: 'note'}, 'Ways of the cuts: half a kerf outside of the part. Tabs are cut off after bonding.')));

    function draw() {
        const box = canvas.getBoundingClientRect(), scale = globalThis.devicePixelRatio || 1;
        canvas.width = Math.max(1, box.width * scale), canvas.height = Math.max(1, box.height * scale);
        const pen = canvas.getContext('2d', {willReadFrequently: true});
        const a = turn.value * Math.PI / 180, e = tilt.value * Math.PI / 180;
        const apart = gap.value / 100 * 3 * Math.max(...sheets.thicknesses, sheets.height / pieces.length);
        const at = (x, y, z) => [x * Math.cos(a) - y * Math.sin(a), (x * Math.sin(a) + y * Math.cos(a)) * -Math.sin(e) - z * Math.cos(e)];
        const depth = (x, y) => x * Math.sin(a) + y * Math.cos(a); // away from the eye
        let x0 = Infinity, x1 = -Infinity, y0 = Infinity, y1 = -Infinity;
        pieces.forEach((piece, i) => {
            for (const ring of piece.rings)
                for (const [points, z] of [[ring.bottom, piece.bottom], [ring.top, piece.top]])
                    for (const [x, y] of points) {
                        const [u, v] = at(x, y, z + i * apart);
                        x0 = Math.min(x0, u), x1 = Math.max(x1, u), y0 = Math.min(y0, v), y1 = Math.max(y1, v);
                    }
        });
        const zoom = .92 * Math.min(canvas.width / (x1 - x0 || 1), canvas.height / (y1 - y0 || 1));
        const place = (x, y, z) => {
            const [u, v] = at(x, y, z);
            return [canvas.width / 2 + (u - (x0 + x1) / 2) * zoom, canvas.height / 2 + (v - (y0 + y1) / 2) * zoom];
        };
        pen.lineJoin = 'round';
        pieces.slice(0, Math.round(upTo.value)).forEach((piece, i) => {
            const low = piece.bottom + i * apart, high = piece.top + i * apart, hue = 30 + 12 * (sheets.thicknesses.indexOf(sheets.programs[programOf.get(piece.program)].thickness) % 6);
            const walls = [];
            for (const {top, bottom} of piece.rings)
                top.forEach((p, k) => {
                    const q = top[(k + 1) % top.length], c = bottom[k], d = bottom[(k + 1) % bottom.length];
                    const n = Math.hypot(q[0] - p[0], q[1] - p[1]);
                    if (n === 0) return;
                    const out = [(q[1] - p[1]) / n, (p[0] - q[0]) / n]; // right of the way: away from what stays
                    if (depth(...out) > 1e-9) return; // the far side
                    const light = out[0] * Math.cos(a + .8) - out[1] * Math.sin(a + .8);
                    walls.push({far: depth(...p) + depth(...q), light, quad: [place(...p, high), place(...q, high), place(...d, low), place(...c, low)]});
                });
            walls.sort((s, t) => t.far - s.far);
            for (const {light, quad} of walls) {
                pen.fillStyle = pen.strokeStyle = `hsl(${hue} 38% ${52 + 14 * light}%)`;
                pen.lineWidth = .6 * scale;
                pen.beginPath();
                quad.forEach(([x, y], k) => k ? pen.lineTo(x, y) : pen.moveTo(x, y));
                pen.closePath(), pen.fill(), pen.stroke();
            }
            pen.beginPath();
            for (const {top} of piece.rings) {
                top.forEach((p, k) => k ? pen.lineTo(...place(...p, high)) : pen.moveTo(...place(...p, high)));
                pen.closePath();
            }
            pen.fillStyle = `hsl(${hue} 45% 80%)`, pen.strokeStyle = `hsl(${hue} 40% 32%)`, pen.lineWidth = scale;
            pen.fill('evenodd'), pen.stroke();
        });
        pen.font = `${12 * scale}px sans-serif`, pen.textBaseline = 'middle';
        let last = Infinity;
        pieces.slice(0, Math.round(upTo.value)).forEach((piece, i) => {
            const all = piece.rings.flatMap(ring => ring.top.map(p => place(...p, piece.top + i * apart)));
            const [x, y] = all.reduce((s, t) => t[0] > s[0] ? t : s, [-Infinity, 0]);
            if (last - y < 13 * scale) return; // numbers would lie on each other
            last = y;
            pen.fillStyle = '#1f252b', pen.fillText(String(piece.number), Math.min(x + 6 * scale, canvas.width - 20 * scale), y);
        });
    }
    let held = null;
    canvas.addEventListener('pointerdown', event => { held = [event.clientX, event.clientY, +turn.value, +tilt.value], canvas.setPointerCapture(event.pointerId); });
    canvas.addEventListener('pointerup', () => { held = null; });
    const look = (t, e) => { turn.value = ((t + 540) % 360) - 180, tilt.value = e, draw(); };
    canvas.addEventListener('pointermove', event => { if (held) look(held[2] - (event.clientX - held[0]) / 2, held[3] + (event.clientY - held[1]) / 3); });
    canvas.addEventListener('keydown', event => {
        const by = {ArrowLeft: [-5, 0], ArrowRight: [5, 0], ArrowUp: [0, 5], ArrowDown: [0, -5]}[event.key];
        if (by) event.preventDefault(), look(+turn.value + by[0], +tilt.value + by[1]);
    });
    globalThis.addEventListener('resize', draw);
    draw();
}

const places = list => list.map(([x, y]) => `${figure(x, 1)} ${figure(y, 1)}`).join(' · ');

function buildAssembly(section) {
    const rows = sheets.pieces.map((piece, i) => {
        const next = sheets.pieces[i + 1], below = sheets.pieces[i - 1];
        const key = ([x, y]) => `${x} ${y}`, own = new Set(piece.dowels.map(key));
        const shared = below ? below.dowels.filter(hole => own.has(key(hole))) : [];
        return [piece.number, `${figure(piece.bottom, 3)}\u00a0–\u00a0${figure(piece.top, 3)}`, figure(piece.top - piece.bottom, 3), nameOf(piece.program), piece.islands > 1 ? piece.islands : '',
            i === 0 ? 'lay down' : shared.length ? places(shared) : '', piece.tabs.length ? 'yes' : '', next ? figure(piece.joint_mm2, 0) : '', places(piece.pins)];
    });
    section.append(table('From below. x and y are the part\'s.', ['Piece', 'z, mm', 'Thick, mm', 'From', 'Islands', 'Dowels into the one below, x y', 'Tabs', 'Bonded above, mm²', 'Pins: left · right · front · back'],
        rows, [0, 1, 2, 4, 7]));
}

function buildCuts(section) {
    section.append(table('Thin stock first.', ['Program', 'Stock, mm', 'Thick, mm', 'Pieces', 'Cut, m', 'Time', 'Offcut, mm'],
        sheets.programs.map(p => [nameOf(p.file), `${figure(p.length)} × ${figure(p.width)}`, figure(p.thickness), p.pieces.join(', '), figure(p.cut_mm / 1000, 2), duration(p.minutes),
            p.offcut.length ? `${figure(p.offcut[0], 0)} × ${figure(p.offcut[1], 0)}` : '–']), [2, 4, 5]));
}

function buildNests(section) {
    const flat = (points, end = 'Z') => {
        let text = '';
        for (let i = 0; i < points.length; i += 2) text += `${i ? 'L' : 'M'}${points[i] / 100} ${-points[i + 1] / 100}`;
        return text + end;
    };
    section.append(make('div', {class: 'nests'}, sheets.programs.map((program, i) => {
        const thin = Math.max(program.length, program.width) / 700, size = Math.max(program.length, program.width) / 32;
        const label = piece => {
            const own = ways[i].filter(way => way.piece === piece.number && !way.hole && way.pass === 0).map(way => way.top);
            const x = own.flatMap(top => top.filter((_, k) => k % 2 === 0)), y = own.flatMap(top => top.filter((_, k) => k % 2 === 1));
            const middle = list => list.length ? (list.reduce((s, t) => Math.min(s, t)) + list.reduce((s, t) => Math.max(s, t))) / 200 : 0;
            return make('text', {class: 'mark', x: middle(x), y: -middle(y), 'font-size': size}, String(piece.number));
        };
        const own = sheets.pieces.filter(piece => piece.program === program.file);
        const on = piece => ([x, y]) => {
            const [u, v] = piece.turn === 90 ? [-y, x] : piece.turn === 180 ? [-x, -y] : piece.turn === 270 ? [y, -x] : [x, y];
            return [100 * (u + piece.x), 100 * (v + piece.y)];
        };
        return make('figure', {class: 'card'}, make('h3', {}, `${nameOf(program.file)}: ${figure(program.thickness)} mm`),
            make('svg', {viewBox: `${-2 * thin} ${-program.width - 2 * thin} ${program.length + 4 * thin} ${program.width + 4 * thin}`, role: 'img', 'aria-label': `Pieces ${program.pieces.join(', ')} on a sheet of ${figure(program.length)} by ${figure(program.width)} mm`},
                make('rect', {class: 'stock', x: 0, y: -program.width, width: program.length, height: program.width, 'stroke-width': thin}),
                own.flatMap(piece => piece.tabs.map(tab => make('path', {class: 'tab', d: flat(tab.flatMap(on(piece))), 'stroke-width': thin / 2}))),
                own.flatMap(piece => piece.engraved.flatMap(({strokes}) => strokes.map(stroke => make('path', {class: 'engraved', d: flat(stroke.flatMap(on(piece)), ''), 'stroke-width': thin})))),
                ways[i].map(way => make('path', {class: way.hole ? 'way hole' : 'way', d: flat(way.top), 'stroke-width': thin})), own.map(label)),
            make('figcaption', {}, `${plural(program.pieces.length, 'piece')}, ${figure(program.length)} × ${figure(program.width)} mm. Zero is the lower left corner, x to the right. Red: outlines; blue: holes${own.some(p => p.tabs.length) ? '; orange: tabs' : ''}${own.some(p => p.engraved.length) ? '; green: engraved' : ''}.`));
    })));
}

document.title = `${sheets.input.file}: sheets`;
part('title').textContent = sheets.input.file;
buildSummary(part('summary'));
buildStack(part('stack'));
buildAssembly(part('assembly'));
buildCuts(part('cuts'));
buildNests(part('nests'));
part('footer').append(make('p', {}, `Made by Slabwright from sheets.json, the programs and verify.json; part ${sheets.input.file}, SHA-256 ${sheets.input.sha256}. All lengths in millimetres. This page needs no network.`));
