// Bundles each page into one HTML file, and writes that as C++ string literals for io/report_template.cpp.
//     node build.mjs OUT_FOLDER
import {build} from 'esbuild';
import {mkdirSync, readFileSync, writeFileSync} from 'node:fs';
import {dirname, join} from 'node:path';
import {fileURLToPath} from 'node:url';

const here = dirname(fileURLToPath(import.meta.url));
const out = process.argv[2] ?? join(here, 'dist');

async function bundle(entry) {
    const result = await build({
        entryPoints: [join(here, 'src', entry)],
        bundle: true,
        minify: true,
        write: false,
        format: 'iife',
        target: 'es2020',
        charset: 'utf8',
        legalComments: 'none',
        absWorkingDir: here,
        logLevel: 'warning',
    });
    return result.outputFiles[0].text.trim();
}

// Licences of what is bundled, which ask to be named in every copy.
function licences() {
    const named = [];
    for (const name of ['three', '@observablehq/plot', 'd3']) {
        const package_ = JSON.parse(readFileSync(join(here, 'node_modules', name, 'package.json'), 'utf8'));
        const text = readFileSync(join(here, 'node_modules', name, 'LICENSE'), 'utf8').replaceAll('--', '- -').trim();
        named.push(`${package_.name} ${package_.version}, ${package_.license}\n\n${text}`);
    }
    return `<!--\nThis page holds parts of:\n\n${named.join('\n\n')}\n-->`;
}

// A raw string literal ends at its delimiter, and some compilers limit the length of one.
function write(name, html) {
    const pieces = [];
    const bytes = Buffer.from(html, 'utf8');
    if (html.includes(')slabwright"')) throw new Error('the page holds the delimiter of its own literal');
    for (let at = 0; at < bytes.length;) {
        let end = Math.min(at + 15000, bytes.length);
        while (end < bytes.length && (bytes[end] & 0xc0) === 0x80) --end; // not within a character
        pieces.push(`R"slabwright(${bytes.subarray(at, end).toString('utf8')})slabwright"`);
        at = end;
    }
    writeFileSync(join(out, `${name}.html`), html);
    writeFileSync(join(out, `${name}.inc`), pieces.join('\n') + '\n');
}

function filled(template, parts) {
    let html = readFileSync(join(here, 'src', template), 'utf8');
    for (const [name, text] of Object.entries(parts)) html = html.replace(`{{${name}}}`, () => text);
    return html;
}

mkdirSync(out, {recursive: true});
const style = await bundle('style.css');
write('report_page', filled('page.html', {style, model: await bundle('view3d.js'), main: await bundle('main.js'), licences: licences()}));
write('assembly_page', filled('assembly.html', {style: style + await bundle('assembly.css'), assembly: await bundle('assembly.js')}));
