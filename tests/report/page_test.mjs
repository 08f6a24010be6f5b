// The report of the pump cover as a pattern maker meets it, in headless Chromium.
//     node page_test.mjs SOURCE COMMAND WORK_FOLDER

import {execFileSync} from 'node:child_process';
import {copyFileSync, mkdirSync, readFileSync, rmSync, statSync, writeFileSync} from 'node:fs';
import {browser, Checks, open, pdfPages} from './browser.mjs';

const [,, source, command, work] = process.argv;
const {started, axe, missing} = await browser(source);
if (missing) {
    console.log(`skipped: ${missing}`);
    process.exit(0);
}
const check = new Checks();
rmSync(work, {recursive: true, force: true});
mkdirSync(work, {recursive: true});
const out = `${work}/out`;
copyFileSync(`${source}/tests/data/pump-cover.stl`, `${work}/pump-cover.stl`);
execFileSync(command, ['plan', `${work}/pump-cover.stl`, '-o', out, '--quiet', '--no-verify']);
const file = `${out}/report.html`;
const plan = JSON.parse(readFileSync(`${out}/plan.json`, 'utf8'));
const layers = plan.layers.length;

// Before the simulation the page says that nothing is proven.
{
    const {page, complaints} = await open(started, file);
    check.that('unverified: does not say yes', !(await page.locator('#verdict .answer').textContent()).startsWith('Yes'));
    check.that('unverified: says how', (await page.locator('#verdict').textContent()).includes('slabwright verify'));
    check.equal('unverified: no complaints', complaints, []);
    await page.close();
}
// Verifying brings the page up to date; making it again gives the same bytes.
execFileSync(command, ['verify', out, '--quiet']);
const refreshed = readFileSync(file);
execFileSync(command, ['report', out, '--quiet', '--threads', '1']);
check.that('verify leaves the page that report makes', refreshed.equals(readFileSync(file)));
const verify = JSON.parse(readFileSync(`${out}/verify.json`, 'utf8'));
// The command prints the sheets as the browser does: a cover, the cut list, and a page for each layer.
{
    execFileSync(command, ['report', out, '--quiet', '--pdf', `${work}/sheets.pdf`]);
    const pages = pdfPages(readFileSync(`${work}/sheets.pdf`));
    check.that('report --pdf: the sheets', pages >= layers + 2 && pages <= 2 * layers + 3, `${pages} pages for ${layers} layers`);
}
const {page, complaints, requests} = await open(started, file);
const change = (selector, value) => page.locator(selector).evaluate((element, v) => {
    element.value = v;
    element.dispatchEvent(new Event(element.tagName === 'SELECT' ? 'change' : 'input', {bubbles: true}));
}, value);
const stage = name => page.locator('#scene').getAttribute(`data-${name}`);
const numbers = text => text.split(',').map(Number);

const clock = minutes => { const m = Math.round(minutes); return m < 60 ? `${m} min` : `${Math.floor(m / 60)} h ${String(m % 60).padStart(2, '0')} min`; };

// What it says equals what it was made from.
{
    const data = await page.evaluate(() => JSON.parse(document.getElementById('slabwright-data').textContent));
    check.equal('data: plan.json', data.plan, plan);
    check.equal('data: verify.json', data.verify, verify);
    const text = await page.locator('#summary').textContent();
    check.equal('summary: build time', await page.locator('#build-time').textContent(), clock(plan.totals.build_minutes));
    check.that('summary: verdict', (await page.locator('#verdict .answer').textContent()).startsWith(verify.passed ? 'Yes' : 'No'));
    check.that('summary: gouge', text.includes(`${Number(verify.totals.gouge_max_mm.toFixed(4))} mm`));
    check.that('summary: left-over', text.includes(`${Number(verify.totals.left_over_missed_max_mm.toFixed(3))} mm`));
    const glue = plan.layers.reduce((sum, layer) => sum + layer.glue_area_mm2, 0) / 100;
    check.that('summary: glue', text.includes(`${glue.toFixed(1)} cm²`), glue);
    const magazine = await page.locator('#magazine tbody tr td:first-child').allTextContents();
    const used = new Set(plan.layers.flatMap(layer => layer.operations.map(o => o.tool)));
    check.equal('summary: tools in the order of their numbers', magazine, plan.tools.map(t => t.number).filter(n => used.has(n)).sort((a, b) => a - b).map(n => `T${n}`));
    // The parts of the build time, from the page's own plot data, are the whole.
    const steps = data.steps.reduce((sum, step) => sum + step[2], 0) / 60;
    check.that('data: steps are the build time', Math.abs(steps - plan.totals.build_minutes) < 0.02 * plan.totals.build_minutes, `${steps} ${plan.totals.build_minutes}`);
    check.equal('tables: rows', [await page.locator('#layers tbody tr').count(), await page.locator('#operations tbody tr').count(), await page.locator('#tools tbody tr').count()],
        [layers, plan.totals.operations, plan.tools.length]);
    check.equal('tables: narrow cavities', await page.locator('#cavities tbody tr').count(), data.cavities.slenderest.length);
    check.equal('tables: draft and draw', await page.locator('#draw tbody tr').count(),
        ['little_draft', 'undercut_to_draw', 'thin_walls', 'inner_corners'].reduce((sum, kind) => sum + data.draw[kind].largest.length, 0));
    check.that('data: forces along every program', data.engagement.length === plan.totals.operations && plan.layers.flatMap(layer => layer.operations).every((o, i) => data.engagement[i].file === o.file && (o.minutes < 1 || data.engagement[i].force_n.some(f => f > 0))));
    // A force along a roughing program stays near the plan's nominal heaviest cut: same model, depth and width from the stock.
    const operations = plan.layers.flatMap(layer => layer.operations);
    operations.forEach((operation, i) => {
        if (operation.kind !== 'rough') return;
        const most = Math.max(...data.engagement[i].force_n);
        check.that(`data: force of ${operation.file}`, most > 0.3 * operation.peak_force_n && most < 1.5 * operation.peak_force_n, `${most} ${operation.peak_force_n}`);
    });
}

// The sheets say what the plan says, once.
{
    const minutesOf = text => { const [, h, m] = /(?:(\d+) h )?(\d+) min/.exec(text); return 60 * Number(h ?? 0) + Number(m); };
    const cover = page.locator('.sheet.cover');
    check.that('cover: the build time', (await cover.locator('.clock').textContent()).includes(clock(plan.totals.build_minutes)));
    const times = await cover.locator('table').last().locator('tbody tr td:last-child').allTextContents();
    check.equal('cover: the layers’ times add up', times.slice(0, -1).reduce((sum, t) => sum + minutesOf(t), 0), minutesOf(times[times.length - 1]));
    for (let l = 0; l < layers; ++l) {
        const sheet = page.locator('.sheet:not(.cutlist)').nth(l + 1), text = await sheet.textContent(), layer = plan.layers[l];
        check.that(`sheet ${l + 1}: every program`, layer.operations.every(o => text.includes(o.file.replace('nc/', ''))));
        check.that(`sheet ${l + 1}: speeds and stick-outs`, layer.operations.every(o => {
            const tool = plan.tools.find(t => t.number === o.tool);
            return text.includes(String(o.spindle_rpm).replace(/(\d)(?=(\d{3})$)/, '$1 ')) && text.includes(String(tool.holder.stickout));
        }));
        const down = plan.frame === 'layer-top' ? layer.z_top : 0, shown = v => `${v < -0.004 ? '−' : ''}${Number(Math.abs(v).toFixed(2))}`;
        check.that(`sheet ${l + 1}: heights as the control shows them`, (await sheet.locator('.side-view').getAttribute('aria-label')).includes(`raw slab top at z ${Number((layer.z_bottom + layer.slab_thickness - down).toFixed(2))},`)
            && (await sheet.locator('.side-view').textContent()).includes(`z ${shown(layer.z_bottom - down)}`));
        check.that(`sheet ${l + 1}: the slab’s measures`, (await sheet.locator('.plan-view').textContent()).includes(`slab ${Number((plan.stock.max[0] - plan.stock.min[0]).toFixed(1))}`));
    }
    // The cut list draws every piece of every board with its measures.
    const cutlist = page.locator('.sheet.cutlist'), boards = plan.wood.boards;
    check.equal('cut list: a drawing for each board', await cutlist.locator('svg').count(), boards.length);
    for (const [b, board] of boards.entries()) {
        const label = await cutlist.locator('svg').nth(b).getAttribute('aria-label'), size = v => Number(v.toFixed(1));
        check.that(`cut list: board ${b + 1} names its pieces`, board.pieces.every(p => label.includes(`${p.layer ? `layer ${p.layer}` : 'base board'} ${size(p.length)} × ${size(p.width)}`)), label);
        check.equal(`cut list: board ${b + 1} has its rectangles`, await cutlist.locator('svg').nth(b).locator('rect').count(), 1 + board.pieces.length + board.cuts.length + board.offcuts.length);
    }
    const counted = (await cutlist.locator('tbody tr td:first-child').allTextContents()).reduce((sum, text) => sum + Number(text), 0);
    check.equal('cut list: counts all pieces', counted, boards.reduce((sum, board) => sum + board.pieces.length, 0));
    // Feeds are those of the programs.
    const {feeds} = await page.evaluate(() => JSON.parse(document.getElementById('slabwright-data').textContent));
    plan.layers.flatMap(layer => layer.operations).forEach((operation, i) => {
        const said = new Set([...readFileSync(`${out}/${operation.file}`, 'utf8').matchAll(/\bF([\d.]+)/g)].map(([, f]) => Math.round(Number(f))));
        check.that(`feeds of ${operation.file}`, said.has(feeds[i].low) && said.has(feeds[i].high) && Math.max(feeds[i].high, feeds[i].plunge ?? 0) === Math.max(...said), JSON.stringify(feeds[i]));
    });
    const box = page.locator('.sheet:not(.cutlist)').nth(1).locator('input[type=checkbox]').first();
    await box.check();
    check.that('sheet: a check can be ticked', await box.isChecked());
    await box.uncheck();
}

// The stack as it is cut: another picture than the pattern, and no wood in the air.
{
    await page.locator('#view').scrollIntoViewIfNeeded();
    await page.waitForTimeout(60);
    const drawn = (await page.locator('#canvas').screenshot()).toString('base64');
    await change('#shape', 'built');
    await page.waitForTimeout(60);
    check.that('view: wood as cut', (await page.locator('#canvas').screenshot()).toString('base64') !== drawn);
    await change('#shape', 'pattern');
    const {wood, stock} = await page.evaluate(() => JSON.parse(document.getElementById('slabwright-data').textContent));
    check.equal('data: wood of every layer', wood.layers.length, layers);
    for (const [l, {rle, data}] of wood.layers.entries()) {
        const bytes = Buffer.from(data, 'base64');
        let points = 0;
        if (rle) for (let i = 0; i < bytes.length; i += 2) points += bytes[i];
        check.equal(`data: points of layer ${l + 1}`, rle ? points : bytes.length, stock.nx * stock.ny);
    }
}

// The slider moves layers.
{
    const before = numbers(await stage('layers'));
    check.that('explode: together at first', before.every(z => z === 0) && before.length === layers);
    await change('#explode', '0.5');
    const after = numbers(await stage('layers'));
    check.that('explode: each above the one below', after.every((z, l) => l === 0 ? z === 0 : z > after[l - 1] + 1), String(after));
    await change('#explode', '0');
    check.that('explode: back', numbers(await stage('layers')).every(z => z === 0));
}

// A row leads to its place.
{
    await page.locator('#layers tbody tr').nth(1).locator('button').click();
    check.equal('row: layer', await stage('layer'), '1');
    check.that('row: marked', await page.locator('#layers tbody tr').nth(1).getAttribute('data-chosen') !== null);
    const z = numbers(await stage('place'))[2];
    check.that('row: in the layer', z > plan.layers[1].z_bottom && z < plan.layers[1].z_top);
    await page.locator('#operations tbody tr').nth(7).locator('button').click();
    check.equal('row: operation', await stage('operation'), '7');
    check.equal('row: chosen in the view', await page.locator('#operation').inputValue(), '7');
}

// Time runs along the program: the tip ends where the program ends, and the stock only shrinks.
{
    const operations = plan.layers.flatMap(layer => layer.operations);
    const rough = operations.findIndex(o => o.kind === 'rough');
    await change('#operation', String(rough));
    const stock = [];
    for (const share of ['0', '0.3', '0.7', '1']) {
        await change('#time', share);
        stock.push(Number(await stage('stock')));
    }
    check.that('stock: shrinks', stock.every((v, i) => i === 0 || v < stock[i - 1]), String(stock));
    const tip = numbers(await stage('tip'));
    const last = {};
    for (const line of readFileSync(`${out}/${operations[rough].file}`, 'utf8').split('\n'))
        for (const [, axis, value] of line.replace(/\([^)]*\)/g, '').matchAll(/([XYZ])(-?[\d.]+)/g)) last[axis] = Number(value);
    const {min, max} = await page.evaluate(() => JSON.parse(document.getElementById('slabwright-data').textContent).paths);
    const quantum = Math.max(...max.map((v, k) => v - min[k])) / 65535;
    const top = plan.frame === 'layer-top' ? plan.layers[0].z_top : 0;
    check.that('path: ends where the program ends', Math.hypot(tip[0] - last.X, tip[1] - last.Y, tip[2] - last.Z - top) < 2 * quantum + 0.002, `${tip} ${JSON.stringify(last)}`);
    await change('#time', '0.3');
    check.equal('stock: going back gives the same', Number(await stage('stock')), stock[1]);
    await change('#operation', '-1');
}

// Colours and section do not fail, and change the picture.
{
    const picture = async () => { await page.waitForTimeout(60); return (await page.locator('#canvas').screenshot()).toString('base64'); };
    await page.locator('#view').scrollIntoViewIfNeeded();
    const seen = new Set([await picture()]);
    for (const mode of ['surfaces', 'slope', 'reach', 'left', 'draw']) {
        await change('#mode', mode);
        seen.add(await picture());
    }
    await change('#axis', 'y');
    seen.add(await picture());
    await change('#axis', 'none');
    check.equal('view: seven pictures', seen.size, 7);
}

// The layer stack from the other side: another silhouette, as wide as the pattern is there.
{
    const stack = () => page.locator('#plots figure').first().locator('svg[role=img]').innerHTML();
    const before = await stack();
    await change('#stack-side', '1');
    check.that('stack: the other side', await stack() !== before);
    const {y} = await page.evaluate(() => JSON.parse(document.getElementById('slabwright-data').textContent).silhouette);
    const {min, max} = plan.input.bbox, widest = Math.max(...y.map(row => row[row.length - 1] - row[0]));
    check.that('stack: as wide as the pattern', Math.abs(widest - (max[1] - min[1])) < 0.5, String(widest));
    await change('#stack-side', '0');
}

// Sorting, both ways; CSV.
{
    const column = () => page.locator('#operations tbody tr td:nth-child(11)').allTextContents();
    const head = page.locator('#operations thead th').nth(11);
    await head.locator('button').click();
    check.equal('sort: told', await head.getAttribute('aria-sort'), 'ascending');
    const force = (await page.locator('#operations tbody tr td:nth-child(12)').allTextContents()).map(Number);
    check.that('sort: ascending', force.every((v, i) => i === 0 || v >= force[i - 1]), String(force));
    await head.locator('button').click();
    const falling = (await page.locator('#operations tbody tr td:nth-child(12)').allTextContents()).map(Number);
    check.that('sort: descending', falling.every((v, i) => i === 0 || v <= falling[i - 1]));
    check.equal('sort: nothing lost', (await column()).length, plan.totals.operations);
    const [download] = await Promise.all([page.waitForEvent('download'), page.getByRole('button', {name: 'Layers as CSV'}).click()]);
    const csv = readFileSync(await download.path(), 'utf8').trim().split('\r\n');
    check.equal('csv: lines', csv.length, layers + 1);
    check.that('csv: exact figures', csv[1].split(',')[2] === String(plan.layers[0].z_top), csv[1]);
}

// The keyboard alone reaches everything that can be operated, and operates it.
{
    const all = await page.evaluate(() => {
        const list = [...document.querySelectorAll('a[href], button, select, input, summary, [tabindex="0"]')].filter(e => !e.disabled && e.getClientRects().length > 0);
        list.forEach((element, i) => { element.dataset.reach = String(i); });
        return list.length;
    });
    await page.evaluate(() => { document.activeElement?.blur(); window.scrollTo(0, 0); getSelection().removeAllRanges(); });
    const reached = new Set();
    await page.locator('.skip').focus();
    for (let i = 0; i < all + 20; ++i) {
        const at = await page.evaluate(() => document.activeElement?.dataset?.reach);
        if (at !== undefined) reached.add(at);
        await page.keyboard.press('Tab');
    }
    check.equal('keyboard: everything is reached', reached.size, all);
    await page.locator('#explode').focus();
    await page.keyboard.press('End');
    check.that('keyboard: pulls layers apart', numbers(await stage('layers'))[1] > 1);
    await page.keyboard.press('Home');
    await page.locator('#canvas').focus();
    for (const key of ['ArrowLeft', 'ArrowUp', 'Shift+ArrowRight', '+', '-', '1', '2', '3', 'Home']) {
        const before = await stage('camera');
        await page.keyboard.press(key);
        const moved = await page.waitForFunction(old => document.querySelector('#scene').dataset.camera !== old, before, {timeout: 5000}).then(() => true, () => false);
        check.that(`keyboard: ${key} moves the view`, moved);
    }
    await page.locator('#layers tbody tr').nth(2).locator('button').focus();
    await page.keyboard.press('Enter');
    check.equal('keyboard: a row leads to its place', await stage('layer'), '2');
    await page.locator('#operations tbody tr').first().locator('button').focus();
    await page.keyboard.press('Enter');
    await page.locator('#canvas').focus();
    await page.keyboard.press('Space');
    const plays = await page.waitForFunction(() => Number(document.querySelector('#scene').dataset.share) > 0.5, null, {timeout: 20000}).then(() => true, () => false);
    check.that('keyboard: plays', plays, await stage('share'));
    await page.keyboard.press('Space');
    check.equal('keyboard: and pauses', await page.locator('#play').textContent(), 'Play');
    // The whole build: program by program, layer by layer, from the first.
    await page.locator('#operation').selectOption('-1');
    await page.locator('#play-build').click();
    const goes = await page.waitForFunction(() => Number(document.querySelector('#operation').value) >= 2, null, {timeout: 60000}).then(() => true, () => false);
    check.that('the whole build: one program after the other', goes, await page.locator('#operation').inputValue());
    await page.locator('#play-build').click();
    const stood = await stage('share');
    check.equal('the whole build: pauses', await page.locator('#play-build').textContent(), 'Play the whole build');
    await page.waitForTimeout(300);
    check.equal('the whole build: and stands', await stage('share'), stood);
    // What stands after the programs that were played is what each program alone finds.
    await page.evaluate(() => { document.querySelector('#time').value = 0; document.querySelector('#time').dispatchEvent(new Event('input')); });
    const found = await stage('stock'), at = await page.locator('#operation').inputValue();
    await page.locator('#operation').selectOption('-1');
    await page.locator('#operation').selectOption(at);
    check.equal('the whole build: on the same wood', await stage('stock'), found);
}

// The accessibility checker, on the whole page and again in a narrow window.
async function violations(on) {
    await on.evaluate(axe);
    const result = await on.evaluate(() => globalThis.axe.run(document, {runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa', 'best-practice']}));
    return result.violations.map(v => `${v.id}: ${v.nodes.slice(0, 3).map(n => n.html.slice(0, 120)).join(' | ')}`);
}
check.equal('axe: no violations', await violations(page), []);
await page.setViewportSize({width: 420, height: 800});
check.equal('axe: no violations when narrow', await violations(page), []);
check.that('narrow: no sideways scrolling', await page.evaluate(() => document.documentElement.scrollWidth <= window.innerWidth + 1), await page.evaluate(() => document.documentElement.scrollWidth));
await page.setViewportSize({width: 1280, height: 900});

check.equal('print: a cover, the cut list and one page for each layer', pdfPages(await page.pdf({preferCSSPageSize: true})), layers + 2);
check.equal('no complaints', complaints, []);
check.equal('no request leaves the page', requests, []);
check.that('size', statSync(file).size < 10e6);
await page.close();

// The light page, and a page made to be small.
execFileSync(command, ['report', out, '--quiet', '--no-3d']);
{
    const light = await open(started, file);
    check.that('light: smaller', statSync(file).size < 1e6, statSync(file).size);
    check.equal('light: no view', await light.page.locator('canvas').count(), 0);
    check.equal('light: a cover, a cut list and sheets', await light.page.locator('.sheet').count(), layers + 2);
    check.equal('light: no complaints', light.complaints, []);
    check.equal('light: axe', await violations(light.page), []);
    await light.page.close();
}
execFileSync(command, ['report', out, '--quiet', '--size-limit', '2']);
{
    const small = await open(started, file);
    check.that('small: kept', statSync(file).size <= 2e6, statSync(file).size);
    const {paths} = await small.page.evaluate(() => JSON.parse(document.getElementById('slabwright-data').textContent));
    check.that('small: says what it cost', paths.tolerance_mm > 0.03, paths.tolerance_mm);
    check.equal('small: no complaints', small.complaints, []);
    await small.page.close();
}
let refused = 0;
try { execFileSync(command, ['report', out, '--quiet', '--size-limit', '0.2'], {stdio: 'pipe'}); } catch (error) { refused = error.status; }
check.equal('a limit that cannot be kept is refused', refused, 2);

// Without WebGL the rest of the page stays.
{
    const context = await started.newContext();
    const bare = await context.newPage();
    await bare.addInitScript(() => { HTMLCanvasElement.prototype.getContext = () => null; });
    const thrown = [];
    bare.on('pageerror', error => thrown.push(error.message));
    await bare.goto(`file://${file}`);
    check.equal('no WebGL: says so', await bare.locator('#no-webgl').count(), 1);
    check.equal('no WebGL: tables', await bare.locator('#layers tbody tr').count(), layers);
    check.equal('no WebGL: nothing thrown', thrown, []);
    await context.close();
}
// Where there is a library to choose from, how the tools of each layer were chosen.
{
    const chosen = `${work}/chosen`, job = `${work}/luo.toml`;
    writeFileSync(job, execFileSync(command, ['job', '--defaults', '--library', 'luo']));
    execFileSync(command, ['plan', `${source}/tests/data/half-sphere.stl`, '-o', chosen, '--job', job, '--quiet', '--no-verify']);
    const {layers: planned} = JSON.parse(readFileSync(`${chosen}/plan.json`, 'utf8'));
    const {page, complaints} = await open(started, `${chosen}/report.html`);
    for (const [table, key] of [['candidates', 'candidates'], ['sets', 'sets']]) {
        const entries = planned.flatMap(layer => layer.selection[key]);
        check.that(`selection: there are ${key}`, entries.length > 0);
        check.equal(`selection: reasons of ${key}`, await page.locator(`#${table} tbody tr td:last-child`).allTextContents(), entries.map(e => e.reason));
        check.equal(`selection: chosen ${key}`, await page.locator(`#${table} tbody td.chosen`).count(), entries.filter(e => e.chosen).length);
    }
    check.equal('selection: no complaints', complaints, []);
    await page.close();
}
check.equal('selection: no tables without a choice', await (async () => {
    const fixed = `${work}/fixed`;
    execFileSync(command, ['plan', `${source}/tests/data/half-sphere.stl`, '-o', fixed, '--tools', 'fixed', '--quiet', '--no-verify']);
    const {page} = await open(started, `${fixed}/report.html`);
    const count = await page.locator('#candidates, #sets').count();
    await page.close();
    return count;
})(), 0);
// Supports stand on the sheets of the layers that they go through, and are sawn off in the end.
{
    const facets = [];
    const box = (x0, y0, z0, x1, y1, z1) => {
        const v = [[x0, y0, z0], [x1, y0, z0], [x1, y1, z0], [x0, y1, z0], [x0, y0, z1], [x1, y0, z1], [x1, y1, z1], [x0, y1, z1]];
        for (const [a, b, c, d] of [[3, 2, 1, 0], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]) facets.push([v[a], v[b], v[c]], [v[a], v[c], v[d]]);
    };
    box(0, 0, 0, 60, 60, 50);
    box(100, 0, 25, 140, 60, 50); // a leg that ends in the air
    box(40, 20, 42, 120, 40, 50);
    writeFileSync(`${work}/leg.stl`, `solid leg\n${facets.map(t => `facet normal 0 0 0\nouter loop\n${t.map(p => `vertex ${p.join(' ')}\n`).join('')}endloop\nendfacet\n`).join('')}endsolid leg\n`);
    const built = `${work}/leg`;
    writeFileSync(`${work}/leg.toml`, ['name = "bolt"\ncircle = [230, 30, 8]\nheight = 20', 'name = "fence"\nrectangle = [-120, 0, -100, 60]\nheight = 55.5',
        'name = "stop"\npolygon = [[230, 60], [250, 60], [230, 90]]\nheight = 5'].map(k => `[[machine.keep_out]]\n${k}\n`).join(''));
    execFileSync(command, ['plan', `${work}/leg.stl`, '-o', built, '--job', `${work}/leg.toml`, '--allow-undercut', '--quiet', '--no-verify']);
    const {supports, layers: planned} = JSON.parse(readFileSync(`${built}/plan.json`, 'utf8'));
    const {page, complaints} = await open(started, `${built}/report.html`);
    check.that('supports: there is one', supports.length > 0);
    for (const [l, layer] of planned.entries())
        check.equal(`supports: on the sheet of layer ${layer.index}`, await page.locator(`#sheet-${l + 1} .plan-view path.support`).count(),
            supports.filter(s => s.z_low < layer.z_top - 0.001 && s.z_high > layer.z_bottom + 0.001).length);
    check.that('supports: sawn off in the end', (await page.locator('.cover .steps li:last-child').textContent()).includes(`saw off ${supports.length} support`));
    check.equal('supports: no complaints', complaints, []);
    // So are bolts and fences, within the drawing; the first sheet asks for them.
    check.equal('keep-outs: in the view', await page.evaluate(() => document.querySelector('#scene').dataset.keep), '3');
    check.equal('keep-outs: on all sheets', await page.locator('.plan-view path.keep-out').count(), 3 * planned.length);
    check.that('keep-outs: within the drawing', await page.locator('#sheet-1 .plan-view').evaluate(view => {
        const all = view.viewBox.baseVal;
        return [...view.querySelectorAll('path.keep-out')].every(path => {
            const {x, y, width, height} = path.getBBox();
            return x >= all.x && y >= all.y && x + width <= all.x + all.width && y + height <= all.y + all.height;
        });
    }));
    check.equal('keep-outs: asked for once', await page.locator('.sheet .checks', {hasText: 'fence, 55.5 mm over the board'}).count(), 1);
    await page.close();
}
// Dowels stand on the sheets of both layers that they go into, and are cut before the build begins.
{
    const built = `${work}/dowelled`, job = `${work}/dowelled.toml`;
    const drill = ['number = 11', 'kind = "drill"', 'name = "drill 8 mm"', 'diameter = 8', 'flute_length = 45', 'stickout = 60', 'shank_diameter = 8', 'holder_diameter = 30',
        'max_rpm = 6000', 'max_feed = 3000', 'plunge_feed = 600', 'stepdown_min = 1', 'stepdown_max = 6'];
    const defaults = execFileSync(command, ['job', '--defaults']).toString().replace(/^per_joint = 0 /m, 'per_joint = 2 ');
    writeFileSync(job, `${defaults}\n[[tool]]\n${drill.join('\n')}\n`);
    execFileSync(command, ['plan', `${work}/pump-cover.stl`, '-o', built, '--job', job, '--quiet', '--no-verify']);
    const {layers: planned} = JSON.parse(readFileSync(`${built}/plan.json`, 'utf8'));
    const {page, complaints} = await open(started, `${built}/report.html`);
    const of = l => planned[l]?.dowels?.length ?? 0;
    check.that('dowels: there are some', of(0) > 0);
    for (const l of planned.keys()) {
        check.equal(`dowels: under the slab of layer ${l + 1}`, await page.locator(`#sheet-${l + 1} .plan-view circle.dowel.under`).count(), of(l - 1));
        check.equal(`dowels: holes in the top of layer ${l + 1}`, await page.locator(`#sheet-${l + 1} .plan-view circle.dowel:not(.under)`).count(), of(l));
    }
    check.equal('dowels: asked for', await page.locator('.sheet .checks', {hasText: 'dowels set and dry-fitted'}).count(), planned.filter((_, l) => of(l - 1) > 0).length);
    check.that('dowels: cut before', /\d+ dowels Ø 8 × \d+ mm/.test(await page.locator('.cover').textContent()));
    check.equal('dowels: no complaints', complaints, []);
    await page.close();
}
// Inch programs on a table that stays: what the control shows is told in inches, and z 0 is set once.
{
    const built = `${work}/inches`, job = `${work}/inches.toml`;
    writeFileSync(job, '[machine]\nunits = "in"\ntable = "fixed"\ntravel_z = 120.0\nmagazine = 4\n');
    execFileSync(command, ['plan', `${work}/pump-cover.stl`, '-o', built, '--job', job, '--quiet', '--no-verify']);
    const made = JSON.parse(readFileSync(`${built}/plan.json`, 'utf8'));
    const {page, complaints} = await open(started, `${built}/report.html`);
    const inches = v => `${v < 0 ? '−' : ''}${Number((Math.abs(v) / 25.4).toFixed(4))} in`;
    for (const [l, layer] of made.layers.entries()) {
        const text = await page.locator(`#sheet-${l + 1}`).textContent();
        check.that(`inches: slab’s edges of layer ${l + 1}`, text.includes(`left edge is x ${inches(made.stock.min[0])} (`), text);
        check.that(`inches: raw top of layer ${l + 1}`, text.includes(`raw slab top is z ${inches(layer.z_bottom + layer.slab_thickness)} (`));
        check.equal(`inches: z 0 stands in layer ${l + 1}`, text.includes('leave z 0 where it has been since layer 1') && text.includes('Z left as it was'), l > 0);
        check.that(`inches: no warning of what is left alone in layer ${l + 1}`, !text.includes('cannot be touched'));
    }
    check.equal('magazine: places are told by its own table alone', await page.locator('.sheet th', {hasText: /^Place$/}).count(), await page.locator('.sheet h4', {hasText: 'Magazine of 4 places'}).count());
    check.equal('inches: no complaints', complaints, []);
    await page.close();
}
await started.close();
check.end();
