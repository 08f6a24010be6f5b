// Reports of real castings and of a generated pattern of a metre: each under the size limit, and each equal to what it was made from.
//     node castings_test.mjs SOURCE COMMAND WORK_FOLDER MAKE_MODELS
// SLABWRIGHT_CORPUS names the folder of real meshes.

import {execFileSync} from 'node:child_process';
import {copyFileSync, mkdirSync, readFileSync, rmSync, statSync, writeFileSync} from 'node:fs';
import {basename} from 'node:path';
import {browser, Checks, open, pdfPages} from './browser.mjs';

const whole = ({totals}) => totals.unmade_mm3 < 1 && totals.unreachable_mm2 <= 0.01 * totals.pattern_mm2;

const [,, source, command, work, makeModels] = process.argv;
const {started, missing} = await browser(source);
if (missing) {
    console.log(`skipped: ${missing}`);
    process.exit(0);
}
const check = new Checks();
rmSync(work, {recursive: true, force: true});
mkdirSync(work, {recursive: true});

const patterns = [];
execFileSync(makeModels, ['metre', `${work}/metre.stl`, '--facets', '60000', '--height', '30'], {stdio: 'pipe'});
// One thick slab, milled out of its board, and passes as wide as they may be: the test is of the page.
writeFileSync(`${work}/metre.toml`, '[slabs]\nthicknesses = [38.0]\nlayout = "nested"\n[tolerances]\ncusp = 0.4\n');
patterns.push([`${work}/metre.stl`, ['--job', `${work}/metre.toml`, '--allow-undercut', '--no-verify']]);
if (process.env.SLABWRIGHT_CORPUS) {
    for (const name of ['castings/mold_cavity_ktool.stl', 'castings/midget_crankcase_front_pattern.stl', 'castings/bearing_block.stl']) {
        copyFileSync(`${process.env.SLABWRIGHT_CORPUS}/${name}`, `${work}/${basename(name)}`);
        patterns.push([`${work}/${basename(name)}`, name.includes('ktool') ? [] : ['--allow-undercut', '--no-verify']]);
    }
} else {
    console.log('skipped: SLABWRIGHT_CORPUS is not set');
}

for (const [stl, options] of patterns) {
    const name = basename(stl, '.stl'), out = `${work}/${name}`;
    const begin = Date.now();
    try {
        execFileSync(command, ['plan', stl, '-o', out, '--quiet', ...options]);
    } catch (error) {
        if (error.status !== 5) throw error; // a plan that does not make the part is told of in the page
    }
    const plan = JSON.parse(readFileSync(`${out}/plan.json`, 'utf8')), size = statSync(`${out}/report.html`).size;
    check.that(`${name}: size`, size <= 10e6, String(size));
    const {page, complaints, requests} = await open(started, `${out}/report.html`);
    const data = await page.evaluate(() => JSON.parse(document.getElementById('slabwright-data').textContent));
    check.equal(`${name}: plan.json`, data.plan, plan);
    const verify = options.includes('--no-verify') ? null : JSON.parse(readFileSync(`${out}/verify.json`, 'utf8'));
    check.equal(`${name}: verify.json`, data.verify, verify);
    const answer = await page.locator('#verdict .answer').textContent();
    check.that(`${name}: verdict`, verify ? answer.startsWith(!verify.passed ? 'No' : whole(verify) ? 'Yes' : 'All but') : answer.startsWith('Planned'), answer);
    check.equal(`${name}: rows`, await page.locator('#operations tbody tr').count(), plan.totals.operations);
    check.equal(`${name}: every program's way is there`, data.paths.programs.filter(p => p.left_out).length, 0);
    check.that(`${name}: model within a stated error`, data.model.facets <= 80000 && data.model.error_mm < 0.002 * Math.max(...data.model.max.map((v, k) => v - data.model.min[k])), JSON.stringify(data.model.error_mm));
    // The cut list says how slabs come out of their boards, and draws each.
    const cutlist = page.locator('.sheet.cutlist'), how = await cutlist.locator('.key').textContent(), [board] = plan.wood.boards;
    check.that(`${name}: how slabs are cut`, how.startsWith(plan.job.slabs.layout === 'nested' ? 'Slabs are milled out' : 'Every cut'), how);
    check.that(`${name}: only a saw's cuts are drawn`, (board.cuts.length === 0) === (plan.job.slabs.layout === 'nested' || board.offcuts.length + board.pieces.length === 1), String(board.cuts.length));
    check.equal(`${name}: board 1 has its rectangles`, await cutlist.locator('svg').first().locator('rect').count(), 1 + board.pieces.length + board.cuts.length + board.offcuts.length);
    const pages = pdfPages(await page.pdf({preferCSSPageSize: true}));
    // A layer with many programs or warnings may take a second page.
    check.that(`${name}: a cover and a page for each layer`, pages > plan.layers.length && pages <= 2 * plan.layers.length + 2 + Math.ceil(plan.wood.boards.length / 4), `${pages} for ${plan.layers.length}`);
    // What stays filled is told once: the drawn boxes hold what verify.json says.
    if (verify) {
        const cells = data.filled.layers.reduce((sum, layer) => sum + layer.mm3, 0), {unmade_mm3: said} = verify.totals;
        check.that(`${name}: what stays filled`, Math.abs(cells - said) <= 0.1 * said + 200, `${cells} ${said}`);
        check.equal(`${name}: advice`, await page.locator('#advice tbody tr').count(), verify.missing_tools.length);
    }
    // Turning it stays smooth even where everything is drawn by the processor.
    await page.locator('#canvas').focus();
    await page.keyboard.press('ArrowLeft');
    await page.keyboard.press('ArrowUp');
    check.equal(`${name}: no complaints`, complaints, []);
    check.equal(`${name}: no requests`, requests, []);
    await page.close();
    console.log(`${name}: ${(size / 1e6).toFixed(2)} MB, ${data.model.facets} of ${data.model.of} facets within ${data.model.error_mm} mm, `
        + `paths within ${data.paths.tolerance_mm} mm, ${((Date.now() - begin) / 1000).toFixed(1)} s`);
}
await started.close();
check.end();
