// The page of a sheets folder in headless Chromium.
//     node assembly_test.mjs SOURCE COMMAND WORK_FOLDER

import {execFileSync} from 'node:child_process';
import {mkdirSync, readFileSync, rmSync} from 'node:fs';
import {browser, Checks, open} from './browser.mjs';

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
execFileSync(command, ['sheets', `${source}/tests/data/pump-cover.stl`, '-o', out, '--quiet', '--thickness', '6', '12', '--head', 'laser', '--align', 'tabs', '--compare', '--bonding', 'glue',
    '--stock', '600', '500']);
const file = `${out}/assembly.html`;
const sheets = JSON.parse(readFileSync(`${out}/sheets.json`, 'utf8')), verify = JSON.parse(readFileSync(`${out}/verify.json`, 'utf8'));
const before = readFileSync(file);
execFileSync(command, ['verify', out, '--stl', `${source}/tests/data/pump-cover.stl`, '--quiet']);
check.that('verify writes the same page', before.equals(readFileSync(file)));

const {page, complaints, requests} = await open(started, file);
const data = await page.evaluate(() => JSON.parse(document.getElementById('slabwright-data').textContent));
check.equal('data: sheets.json', data.sheets, sheets);
check.equal('data: verify.json', data.verify, verify);
check.equal('verdict', await page.locator('#summary .answer').textContent(), 'Yes');
check.equal('a row for each piece', await page.locator('#assembly tbody tr').count(), sheets.pieces.length);
check.equal('a row for each program', await page.locator('#cuts tbody tr').count(), sheets.programs.length);
check.equal('a drawing for each program', await page.locator('#nests svg').count(), sheets.programs.length);
check.equal('a number for each piece', await page.locator('#nests text').allTextContents(), sheets.programs.flatMap(p => p.pieces.map(String)));
check.equal('a way for each cut', await page.locator('#nests path.way').count(), data.ways.flat().length);
check.equal('ways side by side', await page.locator('#summary tbody tr').count(), sheets.ways.length);
// The numbers stand within their pieces' boxes, on the stock.
check.that('numbers on the stock', await page.locator('#nests svg').evaluateAll(list => list.every(svg => {
    const stock = svg.querySelector('rect').getBoundingClientRect();
    return [...svg.querySelectorAll('text, path')].every(part => {
        const box = part.getBoundingClientRect();
        return box.left >= stock.left - 2 && box.right <= stock.right + 2 && box.top >= stock.top - 2 && box.bottom <= stock.bottom + 2;
    });
})));

// The stack: something is drawn, and pulling, turning and hiding change it.
const picture = () => page.locator('#stack canvas').evaluate(canvas => canvas.toDataURL());
const inked = () => page.locator('#stack canvas').evaluate(canvas => {
    const pixels = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
    let n = 0;
    for (let i = 3; i < pixels.length; i += 4) n += pixels[i] > 0;
    return n / (pixels.length / 4);
});
const share = await inked();
check.that('stack: drawn', share > .03 && share < .9, share);
let last = await picture();
for (const [k, value] of [[0, '90'], [1, '60'], [2, '60'], [3, '3']]) {
    await page.locator('#stack input').nth(k).evaluate((input, v) => { input.value = v; input.dispatchEvent(new Event('input', {bubbles: true})); }, value);
    const next = await picture();
    check.that(`stack: slider ${k} changes it`, next !== last);
    last = next;
}
check.that('stack: three sheets are fewer', await inked() < share);
await page.locator('#stack canvas').focus();
await page.keyboard.press('ArrowLeft');
check.that('stack: keys turn it', await picture() !== last);
check.equal('no complaints', complaints, []);
check.equal('no network', requests, []);
if (axe) {
    await page.evaluate(axe);
    const found = await page.evaluate(() => globalThis.axe.run());
    check.equal('axe', found.violations.map(v => `${v.id}: ${v.nodes[0].html.slice(0, 120)}`), []);
}
await page.close();
await started.close();
check.end();
