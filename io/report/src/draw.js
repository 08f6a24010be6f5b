// What keeps the pattern from being drawn: the kinds, in the order of the model's codes from 1 on, and their colours (0 is the rest).
// Thin walls were not looked for where their limit is 0.

import {figure} from './dom.js';
import {data} from './report.js';

const {limits} = data.draw;

export const drawColors = ['#bebebe', '#e5d400', '#d55e00', '#0072b2'];
export const drawKinds = [
    {title: `draft under ${figure(limits.draft_deg, 2)}°`, of: data.draw.little_draft, worst: p => `${figure(p.draft_deg, 2)}°`},
    {title: 'undercut to the draw', of: data.draw.undercut_to_draw, worst: p => `${figure(p.draft_deg, 2)}°`},
    {title: `wall under ${figure(limits.thin, 2)} mm`, of: data.draw.thin_walls, worst: p => `${figure(p.thickness, 2)} mm`},
    {title: 'sharp inner corner', of: data.draw.inner_corners, worst: p => `${figure(p.angle_deg, 1)}°`},
];

// The largest places of each kind.
export const drawPlaces = drawKinds.flatMap(kind => kind.of.largest.map(place => ({
    kind: kind.title, area: place.area ?? null, length: place.length ?? null, worst: kind.worst(place), where: place.where,
})));

const sizeOf = kind => kind.of.length === undefined ? `${figure(kind.of.area / 100, 1)} cm²` : `${figure(kind.of.length, 0)} mm`;

// "draft under 1°: 12.3 cm² in 4 places"; empty where nothing was found.
const found = drawKinds.filter(kind => kind.of.places > 0)
    .map(kind => `${kind.title}: ${sizeOf(kind)} in ${figure(kind.of.places, 0)} ${kind.of.places === 1 ? 'place' : 'places'}`);
export const drawSums = limits.thin > 0 ? found : [...found, 'thin walls were not looked for: the memory limit'];
