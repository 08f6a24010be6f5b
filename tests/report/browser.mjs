// A headless Chromium for the tests of the report, and checks that are counted.

import {existsSync, readFileSync} from 'node:fs';
import {createRequire} from 'node:module';
import {isDeepStrictEqual} from 'node:util';

const chromiumPath = process.env.SLABWRIGHT_CHROMIUM ?? '/usr/bin/chromium';

// The browser and axe-core, or why there are none.
export async function browser(source) {
    const require = createRequire(`${source}/io/report/package.json`);
    let chromium, axe;
    try {
        ({chromium} = require('playwright-core'));
        axe = readFileSync(require.resolve('axe-core/axe.min.js'), 'utf8');
    } catch {
        return {missing: 'io/report/node_modules is missing: run tools/setup'};
    }
    if (!existsSync(chromiumPath)) return {missing: `${chromiumPath} is missing: run tools/setup tests`};
    const started = await chromium.launch({
        executablePath: chromiumPath,
        args: ['--no-sandbox', '--disable-quic', '--no-first-run', '--disable-background-networking', '--disable-component-update', '--disable-sync',
            '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'],
    });
    return {started, axe};
}

// Opens a report; what it complains of and what it asks for are kept.
export async function open(started, file, options = {}) {
    const page = await started.newPage({viewport: {width: 1280, height: 900}, reducedMotion: 'reduce', ...options});
    page.setDefaultTimeout(180000);  // other tests run beside this one, and no graphics card draws for it
    const complaints = [], requests = [];
    page.on('console', message => { if (message.type() === 'error' || message.type() === 'warning') complaints.push(message.text()); });
    page.on('pageerror', error => complaints.push(error.message));
    page.on('request', request => { if (request.url() !== `file://${file}` && !/^(data|blob):/.test(request.url())) requests.push(request.url()); });
    await page.goto(`file://${file}`);
    await page.waitForFunction(() => document.querySelector('#footer p'));
    return {page, complaints, requests};
}

export class Checks {
    constructor() { this.passed = 0; this.failures = []; }
    that(name, truth, more = '') {
        if (truth) ++this.passed;
        else { this.failures.push(name); console.log(`FAILED ${name} ${more}`); }
    }
    equal(name, got, wanted) {
        const same = isDeepStrictEqual(got, wanted);
        this.that(name, same, same ? '' : `got ${JSON.stringify(got)?.slice(0, 300)}, wanted ${JSON.stringify(wanted)?.slice(0, 300)}`);
    }
    // Exits as ctest wants it.
    end() {
        console.log(`${this.passed} checks passed, ${this.failures.length} failed`);
        process.exit(this.failures.length ? 1 : 0);
    }
}

// Pages of a PDF as Chromium writes it.
export function pdfPages(bytes) {
    return (bytes.toString('latin1').match(/\/Type\s*\/Page(?![a-zA-Z])/g) ?? []).length;
}
