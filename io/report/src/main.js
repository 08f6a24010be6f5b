// The page, part by part. The 3D view is a script of its own, which a light report leaves out.

import {buildPlots} from './plots.js';
import {data, plan} from './report.js';
import {buildSheets} from './sheets.js';
import {buildSummary} from './summary.js';
import {buildTables} from './tables.js';
import {make} from './dom.js';

const part = id => document.getElementById(id);

document.title = `${plan.input.file}: build report`;
part('title').textContent = plan.input.file;

const view = globalThis.slabwrightView ? globalThis.slabwrightView.mount(part('view')) : null;

// Leads to a place: {layer, operation, where, text}. A light report has no view to lead to.
const show = view ? place => {
    part('view').scrollIntoView({block: 'start'});
    view.show(place);
} : null;

buildSummary(part('summary'), show);
buildPlots(part('plots'));
buildTables(part('tables'), show);
buildSheets(part('sheets'));

part('footer').append(make('p', {}, `Made by Slabwright ${plan.version} from plan.json, the programs and ${data.verify ? 'verify.json' : 'no verify.json (not simulated yet)'}; `
    + `pattern ${plan.input.file}, SHA-256 ${plan.input.sha256}. All lengths in millimetres, z from the pattern's bottom. This page needs no network.`));
