// The pattern, its layers, and every program's way, to be turned and cut open. Draws only when something has changed.

import * as THREE from 'three';
import {OrbitControls} from 'three/examples/jsm/controls/OrbitControls.js';
import {bytesOf, figure, make} from './dom.js';
import {drawColors, drawKinds} from './draw.js';
import {keepOutsIn} from './drawing.js';
import {pathOf} from './paths.js';
import {data, featureKinds, flaskRings, featureRange, layerName, operationName, operations, plan, toolOf} from './report.js';
import {Run, StockField} from './stock.js';
import {filledBoxes, woodFloors, woodHeights, woodTop} from './wood.js';

const layerColors = ['#b9c7cc', '#d9c49a'], cutColor = '#c98f4a', woodColors = ['#d3b27c', '#dfc190'], filledColor = '#d3202f', glueColor = '#eab431';
const surfaces = [
    {name: 'Flat, facing up', color: '#4f86c6'}, {name: 'Shallow slope', color: '#6aa84f'}, {name: 'Slope', color: '#d8c690'}, {name: 'Steep', color: '#c9ced2'},
    {name: 'Upright', color: '#98a3ab'}, {name: 'Flat, facing down', color: '#a64d79'}, {name: 'Undercut', color: '#e03131'},
];
const slopeRamp = ['#440154', '#414487', '#2a788e', '#22a884', '#7ad151', '#fde725'], leftRamp = ['#dfe7e3', '#cfe0b8', '#f0d27a', '#e58a3d', '#b3261e', '#6d1030'];
const steepest = Math.cos(80 * Math.PI / 180); // on steeper walls a map seen from above says nothing

function rampColor(ramp, t, target) {
    const at = Math.min(0.9999, Math.max(0, t)) * (ramp.length - 1), i = Math.floor(at);
    return target.set(ramp[i]).lerp(new THREE.Color(ramp[i + 1]), at - i);
}

// Corners, normals and middle of every facet of the model.
function readModel() {
    const {model} = data, shares = new Uint16Array(bytesOf(model.vertices).buffer), bytes = bytesOf(model.indices);
    const indices = model.index_bytes === 2 ? new Uint16Array(bytes.buffer) : new Uint32Array(bytes.buffer);
    const count = indices.length / 3, corners = new Float32Array(9 * count), normals = new Float32Array(3 * count);
    for (let i = 0; i < indices.length; ++i)
        for (let k = 0; k < 3; ++k) corners[3 * i + k] = model.min[k] + shares[3 * indices[i] + k] / 65535 * (model.max[k] - model.min[k]);
    for (let f = 0; f < count; ++f) {
        const c = corners.subarray(9 * f, 9 * f + 9);
        const ux = c[3] - c[0], uy = c[4] - c[1], uz = c[5] - c[2], vx = c[6] - c[0], vy = c[7] - c[1], vz = c[8] - c[2];
        const n = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx], length = Math.hypot(...n) || 1;
        for (let k = 0; k < 3; ++k) normals[3 * f + k] = n[k] / length;
    }
    return {count, corners, normals, reach: bytesOf(model.reach), draw: bytesOf(model.draw), base: model.min[2]};
}

function surfaceOf(nz, low, base) {
    const slope = Math.acos(Math.max(-1, Math.min(1, nz))) * 180 / Math.PI;
    if (slope > 179.9) return low < base + 0.01 ? 2 : 5;
    if (slope > 90.1) return 6;
    if (slope < 0.1) return 0;
    if (slope < plan.job.material.shallow_limit_deg) return 1;
    if (slope < plan.job.cutting.steep_limit_deg) return 2;
    return slope < plan.job.cutting.vertical_deg ? 3 : 4;
}

export function mount(section) {
    const canvas = make('canvas', {tabindex: 0, id: 'canvas', role: 'application', 'aria-label': '3D view of the pattern. Arrow keys turn, with Shift they move, plus and minus zoom, Home shows all.'});
    const labels = make('div', {class: 'labels', 'aria-hidden': 'true'});
    const status = make('p', {class: 'status', id: 'status', role: 'status'});
    const scene_ = make('div', {class: 'scene', id: 'scene'}, canvas, labels, status);
    const panel = make('div', {class: 'panel card', id: 'panel', role: 'group', 'aria-label': 'Controls of the 3D view'});
    section.append(make('div', {class: 'stage'}, scene_, panel));
    let renderer;
    try {
        renderer = new THREE.WebGLRenderer({canvas, antialias: true, preserveDrawingBuffer: false});
    } catch {
        scene_.replaceChildren(make('p', {class: 'missing', id: 'no-webgl'}, 'This browser offers no WebGL, so the 3D view cannot be drawn. Everything else on this page works without it.'));
        panel.remove();
        return {show() {}};
    }
    return new View(renderer, canvas, labels, status, scene_, panel, section);
}

class View {
    constructor(renderer, canvas, labels, status, stage, panel, section) {
        Object.assign(this, {renderer, canvas, labels, status, stage, panel, section});
        const {min, max} = data.model;
        this.size = Math.hypot(...max.map((v, k) => v - min[k]));
        this.centre = new THREE.Vector3(...max.map((v, k) => (v + min[k]) / 2));
        this.scene = new THREE.Scene();
        this.camera = new THREE.PerspectiveCamera(32, 1, this.size / 500, this.size * 60);
        this.camera.up.set(0, 0, 1);
        this.scene.add(new THREE.HemisphereLight('#ffffff', '#a89b86', 2.1), this.camera);
        const lamp = new THREE.DirectionalLight('#ffffff', 1.5);
        lamp.position.set(-0.5, 0.9, 0.6);
        this.camera.add(lamp);
        renderer.localClippingEnabled = true;
        renderer.setPixelRatio(Math.min(2, globalThis.devicePixelRatio || 1));
        renderer.setClearColor(0, 0);
        this.controls = new OrbitControls(this.camera, canvas);
        this.controls.addEventListener('change', () => this.draw());
        this.state = {explode: 0, axis: 'none', section: 0.5, shape: 'pattern', mode: 'layers', operation: -1, share: 0, play: false, whole: false};
        this.model = readModel();
        this.sectionPlane = new THREE.Plane();
        this.buildLayers();
        this.buildFeatures();
        this.buildBoundaries();
        this.buildMachine();
        this.buildJoints();
        this.buildKeepOuts();
        this.pin = new THREE.Mesh(new THREE.TorusGeometry(this.size / 60, this.size / 300, 12, 40), new THREE.MeshBasicMaterial({color: '#d97500', depthTest: false}));
        this.pin.renderOrder = 10;
        this.pin.visible = false;
        this.scene.add(this.pin);
        this.buildPanel();
        this.color();
        this.place();
        this.fit();
        canvas.addEventListener('keydown', event => this.key(event));
        canvas.addEventListener('dblclick', event => this.pick(event));
        new ResizeObserver(() => this.resize()).observe(stage);
        this.resize();
        this.say(`${figure(this.model.count, 0)} of ${figure(data.model.of, 0)} facets, within ${figure(data.model.error_mm, 3)} mm`);
    }

    // ---- what is shown

    buildLayers() {
        const {count, corners, normals} = this.model;
        this.layers = plan.layers.map((layer, l) => {
            const facets = [];
            const low = l === 0 ? -Infinity : layer.z_bottom, high = l === plan.layers.length - 1 ? Infinity : layer.z_top;
            for (let f = 0; f < count; ++f) {
                const c = 9 * f, z0 = Math.min(corners[c + 2], corners[c + 5], corners[c + 8]), z1 = Math.max(corners[c + 2], corners[c + 5], corners[c + 8]);
                if (z1 >= low && z0 <= high) facets.push(f);
            }
            const position = new Float32Array(9 * facets.length), normal = new Float32Array(9 * facets.length), color = new Float32Array(9 * facets.length);
            facets.forEach((f, i) => {
                position.set(corners.subarray(9 * f, 9 * f + 9), 9 * i);
                for (let k = 0; k < 3; ++k) normal.set(normals.subarray(3 * f, 3 * f + 3), 9 * i + 3 * k);
            });
            const geometry = new THREE.BufferGeometry();
            geometry.setAttribute('position', new THREE.BufferAttribute(position, 3));
            geometry.setAttribute('normal', new THREE.BufferAttribute(normal, 3));
            geometry.setAttribute('color', new THREE.BufferAttribute(color, 3));
            const planes = [new THREE.Plane(new THREE.Vector3(0, 0, 1), 0), new THREE.Plane(new THREE.Vector3(0, 0, -1), 0)];
            const outside = new THREE.MeshLambertMaterial({vertexColors: true, side: THREE.FrontSide, clippingPlanes: planes});
            // Where a cut opens the solid its inside shows in one flat colour, which looks like the cut face itself.
            const inside = new THREE.MeshBasicMaterial({color: cutColor, side: THREE.BackSide, clippingPlanes: planes});
            const piece = new THREE.Group();
            piece.add(new THREE.Mesh(geometry, outside), new THREE.Mesh(geometry, inside));
            const capOut = new THREE.MeshLambertMaterial({color: '#d6bd92', side: THREE.FrontSide, clippingPlanes: [], polygonOffset: true, polygonOffsetFactor: 2, polygonOffsetUnits: 4}), capIn = new THREE.MeshBasicMaterial({color: cutColor, side: THREE.BackSide, clippingPlanes: [], polygonOffset: true, polygonOffsetFactor: 2, polygonOffsetUnits: 4});
            for (const [loops, z, up] of [[data.outlines.layers[l].top, layer.z_top, true], [data.outlines.layers[l].bottom, layer.z_bottom, false]]) {
                // The pattern's own top and bottom are there already.
                if (up ? l === plan.layers.length - 1 : l === 0) continue;
                const cap = capOf(loops, up);
                if (!cap) continue;
                for (const material of [capOut, capIn]) {
                    const mesh = new THREE.Mesh(cap, material);
                    mesh.position.z = z + (up ? -1 : 1) * this.size * 2e-5;
                    piece.add(mesh);
                }
            }
            const group = new THREE.Group();
            group.add(piece);
            this.scene.add(group);
            return {layer, facets, geometry, group, piece, planes, materials: [outside, inside], caps: [capOut, capIn], low, high};
        });
    }

    buildFeatures() {
        const shown = plan.features.slice(0, 4000);
        const radius = this.size / 170, mesh = new THREE.InstancedMesh(new THREE.SphereGeometry(radius, 12, 8), new THREE.MeshLambertMaterial({}), Math.max(1, shown.length));
        this.features = {mesh, shown};
        mesh.count = shown.length;
        this.scene.add(mesh);
    }

    placeFeatures() {
        const matrix = new THREE.Matrix4(), color = new THREE.Color();
        this.features.shown.forEach((feature, i) => {
            const z = featureRange(feature)[0] - 0;
            matrix.makeTranslation(feature.xy[0], feature.xy[1], z + this.shift(this.layerAt(z)));
            this.features.mesh.setMatrixAt(i, matrix);
            this.features.mesh.setColorAt(i, color.set(featureKinds[feature.type]?.color ?? '#6b6b6b'));
        });
        this.features.mesh.instanceMatrix.needsUpdate = true;
        if (this.features.mesh.instanceColor) this.features.mesh.instanceColor.needsUpdate = true;
    }

    buildBoundaries() {
        const [x0, y0] = plan.stock.min, [x1, y1] = plan.stock.max;
        const ring = (points, z, color) => new THREE.LineLoop(new THREE.BufferGeometry().setFromPoints(points.map(([x, y]) => new THREE.Vector3(x, y, z))), new THREE.LineBasicMaterial({color}));
        this.boundaries = this.layers.map(({layer, group}, l) => {
            const lines = new THREE.Group();
            const corners = [[x0, y0], [x1, y0], [x1, y1], [x0, y1]];
            lines.add(ring(corners, layer.z_top, '#17636b'));
            if (l === 0) lines.add(ring(corners, layer.z_bottom, '#8a94a0'));
            for (const loop of flaskRings(l)) lines.add(ring(loop, layer.z_top, '#8a6a3a'));
            group.add(lines);
            const text = `${layer.index}: ${figure(layer.z_top, 2)} mm, ${layer.reason}`;
            const label = make('span', {title: text}, text);
            this.labels.append(label);
            return {lines, label};
        });
        this.pinLabel = make('span', {class: 'pin', hidden: ''});
        this.labels.append(this.pinLabel);
    }

    // What stays filled under overhangs, in red, and where glue goes at each joint.
    buildJoints() {
        this.layers.forEach((entry, l) => {
            const boxes = filledBoxes(l);
            if (boxes.length) {
                const materials = [new THREE.MeshLambertMaterial({color: filledColor, clippingPlanes: []}),
                    // Seen through the wood that hides it.
                    new THREE.MeshBasicMaterial({color: filledColor, clippingPlanes: [], transparent: true, opacity: 0.22, depthTest: false, depthWrite: false})];
                const geometry = boxGeometry(boxes, data.stock.cell_mm * 0.02);
                entry.filled = new THREE.Group();
                for (const material of materials) entry.filled.add(new THREE.Mesh(geometry, material));
                entry.filledMaterials = materials;
                entry.group.add(entry.filled);
            }
            const glue = capOf(data.outlines.layers[l].glue.map((points, i, all) => ({points, parent: parentOf(i, all)})), true);
            if (glue) {
                const material = new THREE.MeshBasicMaterial({color: glueColor, side: THREE.DoubleSide, clippingPlanes: [], polygonOffset: true, polygonOffsetFactor: -2, polygonOffsetUnits: -4});
                entry.glue = new THREE.Mesh(glue, material);
                entry.glue.position.z = plan.layers[l].z_bottom;
                entry.group.add(entry.glue);
            }
        });
    }

    // The wood of every layer as the simulated programs leave it, made when it is first asked for.
    buildWood() {
        this.layers.forEach((entry, l) => {
            if (entry.wood || !woodHeights(l)) return;
            const material = new THREE.MeshLambertMaterial({color: woodColors[l % woodColors.length], side: THREE.DoubleSide, flatShading: true, clippingPlanes: []});
            entry.wood = new THREE.Mesh(woodGeometry(l), material);
            entry.group.add(entry.wood);
        });
    }

    // The cutter, the way and the slab of the chosen operation.
    buildMachine() {
        this.machine = new THREE.Group();
        this.cutter = new THREE.Group();
        this.machine.add(this.cutter);
        this.scene.add(this.machine);
        this.machine.visible = false;
        const {nx, ny, x0, y0, cell_mm: cell} = data.stock, count = nx * ny, edge = 2 * (nx + ny);
        const position = new Float32Array(3 * (count + edge));
        for (let j = 0; j < ny; ++j) for (let i = 0; i < nx; ++i) { position[3 * (j * nx + i)] = x0 + i * cell; position[3 * (j * nx + i) + 1] = y0 + j * cell; }
        // Around the border every point has one below it, so that the slab has sides.
        this.border = [];
        for (let i = 0; i < nx; ++i) this.border.push(i);
        for (let j = 0; j < ny; ++j) this.border.push(j * nx + nx - 1);
        for (let i = nx - 1; i >= 0; --i) this.border.push((ny - 1) * nx + i);
        for (let j = ny - 1; j >= 0; --j) this.border.push(j * nx);
        this.border.forEach((c, b) => { position[3 * (count + b)] = position[3 * c]; position[3 * (count + b) + 1] = position[3 * c + 1]; });
        const geometry = new THREE.BufferGeometry();
        geometry.setAttribute('position', new THREE.BufferAttribute(position, 3));
        geometry.setIndex(new THREE.BufferAttribute(new Uint32Array(6 * ((nx - 1) * (ny - 1) + edge)), 1));
        this.stockMesh = new THREE.Mesh(geometry, new THREE.MeshLambertMaterial({color: '#d3b27c', flatShading: true, side: THREE.DoubleSide, clippingPlanes: []}));
        this.stockMesh.frustumCulled = false;
        this.machine.add(this.stockMesh);
    }

    // What no tool may run into: bolts and fences stand on the base board, a clamp on the slab that is milled.
    buildKeepOuts() {
        this.keepOuts = plan.layers.flatMap((layer, l) => keepOutsIn(l).filter(k => k.slab || l === 0).map(k => {
            const shape = new THREE.Shape(k.around.map(([x, y]) => new THREE.Vector2(x, y)));
            const material = new THREE.MeshLambertMaterial({color: '#b3261e', transparent: true, opacity: 0.55, side: THREE.DoubleSide, clippingPlanes: []});
            const mesh = new THREE.Mesh(new THREE.ExtrudeGeometry(shape, {depth: k.height, bevelEnabled: false}), material);
            mesh.position.z = k.slab ? layer.z_bottom + layer.slab_thickness : 0;
            this.scene.add(mesh);
            return {mesh, slab: k.slab, layer: l, from: mesh.position.z};
        }));
    }

    refreshStock() {
        const {nx, ny} = data.stock, heights = this.run.field.heights, bottom = this.run.field.bottom;
        const {position} = this.stockMesh.geometry.attributes, index = this.stockMesh.geometry.index, z = position.array, to = index.array, count = nx * ny;
        for (let c = 0; c < count; ++c) z[3 * c + 2] = Math.max(bottom, heights[c]);
        this.border.forEach((_, b) => { z[3 * (count + b) + 2] = bottom; });
        const stands = c => heights[c] > bottom + 1e-3;
        let n = 0;
        for (let j = 0; j + 1 < ny; ++j)
            for (let i = 0; i + 1 < nx; ++i) {
                const a = j * nx + i, b = a + 1, c = a + nx, d = c + 1;
                if (!stands(a) && !stands(b) && !stands(c) && !stands(d)) continue; // cut through: what lies below shows
                to[n++] = a; to[n++] = b; to[n++] = d; to[n++] = a; to[n++] = d; to[n++] = c;
            }
        for (let b = 0; b < this.border.length; ++b) {
            const next = (b + 1) % this.border.length, p = this.border[b], q = this.border[next];
            if (p === q || (!stands(p) && !stands(q))) continue;
            to[n++] = p; to[n++] = count + b; to[n++] = count + next; to[n++] = p; to[n++] = count + next; to[n++] = q;
        }
        this.stockMesh.geometry.setDrawRange(0, n);
        position.needsUpdate = index.needsUpdate = true;
    }

    // @param follows whether the operation before it has just ended
    chooseOperation(index, follows = false) {
        const done = this.run;
        this.state.operation = index;
        this.state.share = 0;
        for (const old of ['way', 'faint', 'rapids']) if (this[old]) { this.machine.remove(this[old]); this[old].geometry.dispose(); this[old] = null; }
        this.machine.visible = index >= 0;
        this.run = null;
        for (const control of [this.timeSlider, this.playButton]) control.disabled = index < 0;
        this.timeSlider.value = 0;
        if (index >= 0) {
            const operation = operations[index], tool = toolOf(operation.tool), path = pathOf(index), layer = plan.layers[operation.layer];
            const cutterOf = t => ({radius: t.diameter / 2, ball: t.kind === 'ball'});
            let field, missing = 0;
            if (follows && operations[index - 1].layer === operation.layer) {
                // The one before has just been run to its end.
                ({field} = done);
                missing = this.missing + done.path.leftOut;
            } else {
                field = new StockField(data.stock, layer.z_bottom, layer.z_bottom + layer.slab_thickness);
                for (const earlier of operations.filter(o => o.layer === operation.layer && o.index < index)) {
                    const before = pathOf(earlier.index);
                    missing += before.leftOut;
                    if (before.count > 1) new Run(field, cutterOf(toolOf(earlier.tool)), before).to(1);
                }
            }
            this.run = new Run(field, cutterOf(tool), path);
            this.missing = missing;
            this.cutter.clear();
            this.cutter.add(...cutterMeshes(tool));
            const points = new Float32Array(3 * path.count);
            for (let i = 0; i < path.count; ++i) points.set([path.x(i), path.y(i), path.z(i)], 3 * i);
            const geometry = new THREE.BufferGeometry();
            geometry.setAttribute('position', new THREE.BufferAttribute(points, 3));
            const pairs = rapid => { const list = []; for (let i = 1; i < path.count; ++i) if (path.rapid(i) === rapid) list.push(i - 1, i); return list; };
            const lines = (list, material) => { const g = new THREE.BufferGeometry(); g.setAttribute('position', geometry.attributes.position); g.setIndex(list); return new THREE.LineSegments(g, material); };
            this.faint = lines(pairs(false), new THREE.LineBasicMaterial({color: '#17636b', transparent: true, opacity: path.count > 20000 ? 0.05 : 0.18}));
            this.rapids = lines(pairs(true), new THREE.LineBasicMaterial({color: '#c2571a', transparent: true, opacity: path.count > 20000 ? 0.12 : 0.35}));
            this.way = new THREE.Line(geometry, new THREE.LineBasicMaterial({color: '#0b3d91'}));
            this.machine.add(this.faint, this.rapids, this.way);
        }
        this.select.value = String(index);
        this.place();
        this.time(0);
    }

    time(share) {
        this.state.share = share;
        this.stage.dataset.share = String(share);
        if (!this.run) { this.readout.textContent = ''; this.draw(); return; }
        const operation = operations[this.state.operation], path = this.run.path;
        if (path.count < 2) {
            this.readout.textContent = 'This program is too long for the size limit of the page: its way is not shown.';
            this.cutter.visible = false;
            this.refreshStock();
            this.draw();
            return;
        }
        const [x, y, z, segment] = this.run.to(share);
        this.refreshStock();
        this.cutter.visible = true;
        this.cutter.position.set(x, y, z);
        // The last stretch stands out; all of a long program would hide what it cuts.
        const trail = Math.min(segment + 1, 1500);
        this.way.geometry.setDrawRange(segment + 1 - trail, trail);
        const rapid = path.rapid(Math.min(path.count - 1, segment + 1));
        const seconds = share * operation.minutes * 60;
        this.readout.textContent = `${Math.floor(seconds / 60)}:${String(Math.floor(seconds % 60)).padStart(2, '0')} of ${figure(operation.minutes, 1)} min · x ${figure(x, 1)} y ${figure(y, 1)} z ${figure(z, 2)} · ${rapid ? 'rapid' : 'feed'}`
            + (this.missing ? ` · ${this.missing} earlier programs are not in the page` : '');
        this.stage.dataset.tip = [x, y, z].map(v => v.toFixed(3)).join(',');
        let sum = 0;
        for (const h of this.run.field.heights) sum += h;
        this.stage.dataset.stock = sum.toFixed(1);
        this.draw();
    }

    // ---- where things stand

    gap() { return 1.15 * Math.max(...plan.layers.map(l => l.slab_thickness)) + this.size * 0.02; }
    shift(l) { return l * this.state.explode * this.gap(); }
    layerAt(z) {
        const l = plan.layers.findIndex(layer => z <= layer.z_top + 1e-9);
        return l < 0 ? plan.layers.length - 1 : l;
    }

    // Everything to its height, and the clipping planes with it.
    place() {
        const {axis, section, operation} = this.state, {min, max} = data.model;
        const cut = axis === 'none' ? [] : [this.sectionPlane];
        if (axis !== 'none') {
            const k = 'xyz'.indexOf(axis), normal = new THREE.Vector3();
            normal.setComponent(k, k === 1 ? 1 : -1); // what lies towards the first view's eye is taken away
            const top = max[2] + this.shift(plan.layers.length - 1);
            const low = k === 2 ? min[2] : Math.min(min[k], plan.stock.min[k]), high = k === 2 ? top : Math.max(max[k], plan.stock.max[k]);
            const at = low + section * (high - low);
            this.sectionPlane.set(normal, k === 1 ? -at : at);
            this.sectionReadout.textContent = `${axis} = ${figure(at, 1)} mm`;
        } else {
            this.sectionReadout.textContent = '';
        }
        const milled = operation >= 0 ? operations[operation].layer : -1;
        this.layers.forEach((entry, l) => {
            const z = this.shift(l);
            entry.group.position.z = z;
            entry.planes[0].constant = -(Math.max(-1e6, entry.low) + z);
            entry.planes[1].constant = Math.min(1e6, entry.high) + z;
            for (const material of entry.materials) material.clippingPlanes = [...entry.planes, ...cut];
            for (const material of entry.caps) material.clippingPlanes = cut;
            // While a layer is milled its slab stands in the place of the pattern, and what comes later is not there.
            const there = this.ticks.pattern.checked && (milled < 0 || !this.ticks.stock.checked || l < milled), built = this.state.shape === 'built' && Boolean(entry.wood);
            entry.piece.visible = there && !built;
            if (entry.wood) {
                entry.wood.visible = there && built;
                entry.wood.material.clippingPlanes = cut;
            }
            if (entry.filled) {
                entry.filled.visible = this.ticks.filled.checked && there;
                for (const material of entry.filledMaterials) material.clippingPlanes = cut;
            }
            if (entry.glue) {
                // Between layers that lie on one another it would only shimmer through.
                entry.glue.visible = this.ticks.glue.checked && there && (this.state.explode > 0 || axis !== 'none');
                entry.glue.material.clippingPlanes = cut;
            }
            this.boundaries[l].lines.visible = this.ticks.boundaries.checked;
        });
        for (const {mesh, slab, layer, from} of this.keepOuts) {
            mesh.visible = this.ticks.keep.checked && (!slab || layer === milled);
            mesh.position.z = from + (slab ? this.shift(layer) : 0);
            mesh.material.clippingPlanes = cut;
        }
        this.stage.dataset.keep = String(this.keepOuts.filter(k => k.mesh.visible).length);
        this.machine.position.z = milled >= 0 ? this.shift(milled) : 0;
        this.stockMesh.visible = this.ticks.stock.checked;
        for (const lines of [this.way, this.faint, this.rapids]) if (lines) lines.visible = this.ticks.way.checked;
        this.stockMesh.material.clippingPlanes = cut;
        this.features.mesh.visible = this.ticks.features.checked && (milled < 0 || !this.ticks.stock.checked);
        this.features.mesh.material.clippingPlanes = cut;
        this.placeFeatures();
        this.stage.dataset.layers = this.layers.map(e => e.group.position.z.toFixed(3)).join(',');
        this.draw();
    }

    color() {
        const {mode} = this.state, {normals, corners, reach, draw, base} = this.model, color = new THREE.Color(), {stock} = data;
        const maps = mode === 'left' ? data.left_over.layers.map(bytesOf) : null;
        for (const [l, entry] of this.layers.entries()) {
            const to = entry.geometry.attributes.color;
            entry.facets.forEach((f, i) => {
                const nz = normals[3 * f + 2], c = 9 * f;
                if (mode === 'layers') color.set(layerColors[l % layerColors.length]);
                else if (mode === 'surfaces') color.set(surfaces[surfaceOf(nz, Math.min(corners[c + 2], corners[c + 5], corners[c + 8]), base)].color);
                else if (mode === 'slope') nz < -1e-3 ? color.set('#8b8b8b') : rampColor(slopeRamp, Math.acos(Math.min(1, nz)) / (Math.PI / 2), color);
                else if (mode === 'draw') color.set(drawColors[draw[f]]);
                else if (mode === 'reach') color.set(['#b9bdc0', '#6fae8a', '#d6453d'][reach[f]]);
                else {
                    const x = (corners[c] + corners[c + 3] + corners[c + 6]) / 3, y = (corners[c + 1] + corners[c + 4] + corners[c + 7]) / 3;
                    const gi = Math.min(stock.nx - 1, Math.max(0, Math.round((x - stock.x0) / stock.cell_mm))), gj = Math.min(stock.ny - 1, Math.max(0, Math.round((y - stock.y0) / stock.cell_mm)));
                    const code = maps[l][gj * stock.nx + gi];
                    if (nz < steepest || code === 255) color.set('#b9bdc0');
                    else if (code === 254) color.set('#3557d6');
                    else rampColor(leftRamp, (code / 100) ** 2 / this.leftTop(), color);
                }
                for (let k = 0; k < 3; ++k) to.setXYZ(3 * i + k, color.r, color.g, color.b);
            });
            to.needsUpdate = true;
        }
        this.legend();
        this.draw();
    }

    leftTop() { return Math.max(0.1, 5 * plan.job.tolerances.cusp); }

    legend() {
        const list = entries => make('ul', {class: 'legend'}, entries.map(e => make('li', {}, make('i', {style: `background:${e.color}`}), e.name)));
        const bar = (ramp, from, to) => [make('div', {class: 'ramp', style: `background:linear-gradient(90deg,${ramp.join(',')})`}), make('div', {}, make('span', {}, from), make('span', {}, to))];
        const content = {
            wood: () => [list([{name: 'wood as cut', color: woodColors[0]}]), make('p', {class: 'note'}, `After all programs, from a stock with ${figure(data.stock.cell_mm, 2)} mm between its points; under overhangs it stands where air should be.${data.undersides ? ' What is milled from below is taken out as the slabs’ undersides are planned.' : ''}`)],
            layers: () => list([{name: 'odd layers', color: layerColors[0]}, {name: 'even layers', color: layerColors[1]}, {name: 'cut face', color: cutColor}]),
            surfaces: () => list(surfaces),
            slope: () => [bar(slopeRamp, '0° flat', '90° upright'), list([{name: 'faces down', color: '#8b8b8b'}])],
            reach: () => [list([{name: 'a tool reaches it', color: '#6fae8a'}, {name: 'no flat or ball end mill found that does', color: '#d6453d'}, {name: 'faces down', color: '#b9bdc0'}]),
                make('p', {class: 'note'}, `Asked ${figure(data.model.reach_mm, 2)} mm off the surface, once in each cell of ${figure(data.model.reach_cell_mm, 1)} mm for each way it faces, in its own layer, holder included.`)],
            draw: () => list(['draws well', ...drawKinds.slice(0, 3).map(kind => kind.title)].map((name, i) => ({name, color: drawColors[i]}))),
            left: () => [bar(leftRamp, '0', `${figure(this.leftTop(), 2)} mm and more`), list([{name: 'cut into the part', color: '#3557d6'}, {name: 'faces down, steeper than 80° or flask', color: '#b9bdc0'}]),
                make('p', {class: 'note'}, `After all programs, from a stock with ${figure(data.stock.cell_mm, 2)} mm between its points; verify.json measures finer.`)],
        }[this.state.shape === 'built' ? 'wood' : this.state.mode]();
        this.legendBox.replaceChildren(...[content].flat(2));
        if (this.ticks.filled.checked) this.legendBox.append(list([{name: 'stays filled', color: filledColor}]));
        if (this.ticks.features.checked) this.legendBox.append(list(Object.entries(featureKinds).filter(([type]) => plan.features.some(f => f.type === type)).map(([, kind]) => kind)));
    }

    // ---- controls

    buildPanel() {
        const slider = (label, attributes, input) => {
            const element = make('input', {type: 'range', min: 0, max: 1, step: 0.001, value: 0, ...attributes, oninput: () => input(Number(element.value))});
            return [make('label', {}, label, element), element];
        };
        const tick = (label, checked, change) => {
            const element = make('input', {type: 'checkbox', checked, onchange: change});
            return [make('label', {class: 'tick'}, element, label), element];
        };
        const button = (text, action, attributes = {}) => make('button', {class: 'act', type: 'button', onclick: action, ...attributes}, text);
        const choice = (label, id, options, change) => {
            const element = make('select', {id, onchange: () => change(element.value)}, options.map(([value, text]) => make('option', {value}, text)));
            return [make('label', {}, label, element), element];
        };
        const [explode, explodeSlider] = slider('Pull apart', {id: 'explode'}, value => { this.state.explode = value; this.place(); });
        this.explodeSlider = explodeSlider;
        const [axis, axisSelect] = choice('Section', 'axis', [['none', 'none'], ['x', 'across x'], ['y', 'across y'], ['z', 'across z']], value => { this.state.axis = value; sectionSlider.disabled = value === 'none'; this.place(); });
        this.axisSelect = axisSelect;
        const [section, sectionSlider] = slider('at', {id: 'section', value: 0.5, disabled: true}, value => { this.state.section = value; this.place(); });
        this.sectionReadout = make('output');
        const [mode, modeSelect] = choice('Colour by', 'mode', [['layers', 'layer'], ['surfaces', 'features and undercuts'], ['slope', 'slope (α)'], ['reach', 'accessibility'], ['left', 'left-over'], ...(this.model.draw.length ? [['draw', 'draft and draw']] : [])], value => { this.state.mode = value; this.color(); });
        this.modeSelect = modeSelect;
        const [shape, shapeSelect] = choice('Shape', 'shape', [['pattern', 'pattern as drawn'], ['built', 'wood as cut']], value => {
            this.state.shape = value;
            if (value === 'built') this.buildWood();
            this.modeSelect.disabled = value === 'built';
            this.legend();
            this.place();
        });
        this.shapeSelect = shapeSelect;
        const [patternTick, pattern] = tick('Pattern', true, () => this.place());
        const anyFilled = this.layers.some(entry => entry.filled);
        const [filledTick, filled] = tick('What stays filled', anyFilled, () => { this.place(); this.legend(); });
        filled.disabled = !anyFilled;
        const [glueTick, glue] = tick('Glue, where layers are apart', true, () => this.place());
        const [boundaryTick, boundaries] = tick('Boundaries and reasons', true, () => this.place());
        const [featureTick, features] = tick(`Features (${plan.features.length})`, plan.features.length <= 80, () => { this.place(); this.legend(); });
        const [stockTick, stock] = tick('Stock as simulated', true, () => this.place());
        const [wayTick, way] = tick('Tool path', true, () => this.place());
        const [keepTick, keep] = tick('Keep-outs', true, () => this.place());
        this.ticks = {pattern, boundaries, features, stock, way, filled, glue, keep};
        this.legendBox = make('div', {id: 'legend'});
        const [operation, select] = choice('Operation', 'operation', [['-1', 'none'], ...operations.map(o => [String(o.index), operationName(o)])], value => { if (this.state.whole) this.stop(); this.chooseOperation(Number(value)); });
        this.select = select;
        const [time, timeSlider] = slider('Time', {id: 'time', step: 0.0005, disabled: true}, value => { this.stop(); this.time(value); });
        this.timeSlider = timeSlider;
        this.playButton = button('Play', () => this.toggle(), {id: 'play', disabled: true});
        this.buildButton = button('Play the whole build', () => this.toggleBuild(), {id: 'play-build', disabled: !operations.length});
        this.readout = make('output', {id: 'readout'});
        this.panel.append(
            make('fieldset', {}, make('legend', {}, 'Look'), make('div', {class: 'row'},
                button('Fit', () => this.fit()), button('Top', () => this.look(0, -1e-4, 1)), button('Front', () => this.look(0, -1, 0)), button('Side', () => this.look(1, 0, 0)), button('Below', () => this.look(0, -1e-4, -1)),
                button('+', () => this.zoom(0.8), {'aria-label': 'Nearer'}), button('−', () => this.zoom(1.25), {'aria-label': 'Farther'}))),
            make('fieldset', {}, make('legend', {}, 'Layers'), explode, axis, section, this.sectionReadout),
            make('fieldset', {}, make('legend', {}, 'Show'), shape, mode, patternTick, filledTick, glueTick, boundaryTick, featureTick, this.keepOuts.length ? keepTick : null, this.legendBox),
            make('fieldset', {}, make('legend', {}, 'Cutting'), operation, time, make('div', {class: 'row'}, this.playButton, this.buildButton), this.readout, make('div', {class: 'row ticks'}, stockTick, wayTick),
                make('p', {class: 'note'}, `The stock has ${figure(data.stock.cell_mm, 2)} mm between its points; ways are drawn within ${figure(data.paths.tolerance_mm, 3)} mm, time by feed.`)),
            make('details', {}, make('summary', {}, 'Keys and mouse'), make('p', {class: 'note'},
                'Drag turns, right drag or two fingers move, wheel or pinch zooms, a double click tells what is there. With the view focused: ', make('kbd', {}, '← → ↑ ↓'), ' turn, with ', make('kbd', {}, 'Shift'), ' move, ',
                make('kbd', {}, '+'), ' ', make('kbd', {}, '−'), ' zoom, ', make('kbd', {}, '1'), ' ', make('kbd', {}, '2'), ' ', make('kbd', {}, '3'), ' ', make('kbd', {}, '4'), ' top, front, side, below, ', make('kbd', {}, 'Home'), ' all, ', make('kbd', {}, 'Space'), ' plays.')));
    }

    toggle() { this.state.play ? this.stop() : this.start(); }
    stop() {
        this.state.play = this.state.whole = false;
        this.playButton.textContent = 'Play';
        this.buildButton.textContent = 'Play the whole build';
        this.stage.dataset.whole = '';
    }
    start() {
        if (!this.run) return;
        this.state.play = true;
        this.playButton.textContent = 'Pause';
        if (this.state.share >= 1) this.time(0);
        const minutes = operations.reduce((sum, o) => sum + o.minutes, 0);
        // One program takes 20 s, a whole build 90 s and what its short programs take more.
        const length = () => this.state.whole ? Math.max(600, 90000 * operations[this.state.operation].minutes / minutes) : 20000;
        let last = performance.now();
        const step = now => {
            if (!this.state.play) return;
            const share = Math.min(1, this.state.share + (now - last) / length());
            last = now;
            this.timeSlider.value = share;
            this.time(share);
            const next = this.state.operation + 1;
            if (share >= 1 && this.state.whole && next < operations.length) this.chooseOperation(next, true);
            else if (share >= 1) { this.stop(); return; }
            requestAnimationFrame(step);
        };
        requestAnimationFrame(step);
    }

    // From the first slab's first program to the last one's end; or from where it was stopped on.
    toggleBuild() {
        if (this.state.whole) { this.stop(); return; }
        if (this.state.play) this.stop();
        const {operation, share} = this.state;
        if (operation < 0 || (operation === operations.length - 1 && share >= 1)) this.chooseOperation(0);
        this.state.whole = true;
        this.buildButton.textContent = 'Pause the build';
        this.stage.dataset.whole = 'plays';
        this.start();
    }

    key(event) {
        const turn = Math.PI / 24, step = this.camera.position.distanceTo(this.controls.target) / 20;
        const arrows = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]};
        if (arrows[event.key]) {
            const [x, y] = arrows[event.key];
            if (event.shiftKey) this.pan(x * step, y * step); else this.orbit(x * turn, y * turn);
        } else if (event.key === '+' || event.key === '=') this.zoom(0.85);
        else if (event.key === '-') this.zoom(1 / 0.85);
        else if (event.key === 'Home' || event.key === '0') this.fit();
        else if (event.key === '1') this.look(0, -1e-4, 1);
        else if (event.key === '2') this.look(0, -1, 0);
        else if (event.key === '3') this.look(1, 0, 0);
        else if (event.key === '4') this.look(0, -1e-4, -1);
        else if (event.key === ' ' && this.run) this.toggle();
        else return;
        event.preventDefault();
    }

    // ---- the camera

    orbit(right, up) {
        const way = this.camera.position.clone().sub(this.controls.target), length = way.length();
        const azimuth = Math.atan2(way.y, way.x) + right, height = Math.min(1.5707, Math.max(-1.5707, Math.asin(way.z / length) + up));
        way.set(Math.cos(height) * Math.cos(azimuth), Math.cos(height) * Math.sin(azimuth), Math.sin(height)).multiplyScalar(length);
        this.camera.position.copy(this.controls.target).add(way);
        this.controls.update();
        this.draw();
    }

    pan(right, up) {
        const x = new THREE.Vector3().setFromMatrixColumn(this.camera.matrix, 0), y = new THREE.Vector3().setFromMatrixColumn(this.camera.matrix, 1);
        const way = x.multiplyScalar(right).add(y.multiplyScalar(up));
        this.camera.position.add(way);
        this.controls.target.add(way);
        this.controls.update();
        this.draw();
    }

    zoom(factor) {
        this.camera.position.sub(this.controls.target).multiplyScalar(factor).add(this.controls.target);
        this.controls.update();
        this.draw();
    }

    look(x, y, z, distance) {
        const aspect = Math.min(1, this.camera.aspect);
        const far = distance ?? (Math.hypot(this.size, this.shift(plan.layers.length - 1)) * 0.56) / Math.tan(this.camera.fov * Math.PI / 360) / aspect;
        this.camera.position.set(x, y, z).normalize().multiplyScalar(far).add(this.controls.target);
        this.controls.update();
        this.draw();
    }

    fit() {
        this.controls.target.copy(this.centre);
        this.controls.target.z += this.shift(plan.layers.length - 1) / 2;
        this.look(0.7, -1.15, 0.75);
    }

    resize() {
        const {clientWidth: width, clientHeight: height} = this.stage;
        if (width === 0 || height === 0) return;
        this.renderer.setSize(width, height, false);
        this.camera.aspect = width / height;
        this.camera.updateProjectionMatrix();
        this.draw();
    }

    draw() {
        if (this.waiting) return;
        this.waiting = true;
        requestAnimationFrame(() => {
            this.waiting = false;
            if (this.pin.visible) this.pin.quaternion.copy(this.camera.quaternion);
            this.renderer.render(this.scene, this.camera);
            this.stage.dataset.camera = this.camera.position.toArray().map(v => v.toFixed(2)).join(',');
            this.putLabels();
        });
    }

    putLabels() {
        const {clientWidth: width, clientHeight: height} = this.stage, at = new THREE.Vector3(), [x0, y0] = plan.stock.min, [x1, y1] = plan.stock.max;
        let lowest = Infinity;
        const project = (x, y, z) => { at.set(x, y, z).project(this.camera); return [(at.x + 1) / 2 * width, (1 - at.y) / 2 * height, at.z < 1]; };
        this.boundaries.forEach(({label}, l) => {
            const z = plan.layers[l].z_top + this.shift(l);
            // At the corner farthest right on the screen.
            const [x, y, seen] = [[x0, y0], [x1, y0], [x1, y1], [x0, y1]].map(([cx, cy]) => project(cx, cy, z)).reduce((a, b) => b[0] > a[0] ? b : a);
            const shown = this.ticks.boundaries.checked && seen && Math.abs(y - lowest) > 15;
            label.hidden = !shown;
            if (!shown) return;
            lowest = y;
            label.style.left = `${Math.min(x, width - label.offsetWidth - 10)}px`;
            label.style.top = `${y}px`;
        });
        this.pinLabel.hidden = !this.pin.visible;
        if (this.pin.visible) {
            const [x, y] = project(this.pin.position.x, this.pin.position.y, this.pin.position.z);
            this.pinLabel.style.left = `${x + 10}px`;
            this.pinLabel.style.top = `${y}px`;
        }
    }

    say(text) { this.status.textContent = text; }

    // What lies under the mouse.
    pick(event) {
        const box = this.canvas.getBoundingClientRect(), ray = new THREE.Raycaster();
        ray.setFromCamera(new THREE.Vector2((event.clientX - box.left) / box.width * 2 - 1, 1 - (event.clientY - box.top) / box.height * 2), this.camera);
        if (this.features.mesh.visible) {
            const [hit] = ray.intersectObject(this.features.mesh);
            if (hit) {
                const feature = this.features.shown[hit.instanceId], [low, high] = featureRange(feature);
                this.show({where: [...feature.xy, low], text: `${featureKinds[feature.type]?.name ?? feature.type}, z ${figure(low, 3)}${high > low ? ` to ${figure(high, 3)}` : ''} mm${feature.area ? `, ${figure(feature.area, 1)} mm²` : ''}`, stay: true});
                return;
            }
        }
        for (const [l, entry] of this.layers.entries()) {
            if (!entry.piece.visible) continue;
            const hit = ray.intersectObject(entry.piece.children[0]).find(h => entry.materials[0].clippingPlanes.every(plane => plane.distanceToPoint(h.point) >= 0));
            if (!hit) continue;
            const slope = Math.acos(Math.max(-1, Math.min(1, hit.face.normal.z))) * 180 / Math.PI;
            this.show({where: [hit.point.x, hit.point.y, hit.point.z - this.shift(l)], text: `${layerName(l)}, slope ${figure(slope, 1)}°`, stay: true});
            return;
        }
    }

    // Leads to a place: {layer, operation, where, text}.
    show({layer, operation, where, text, stay}) {
        this.stop();
        if (operation !== undefined) {
            this.chooseOperation(operation);
            this.timeSlider.value = 0.5;
            this.time(0.5);
        } else if (this.state.operation >= 0) {
            this.chooseOperation(-1);
        }
        const l = layer ?? this.layerAt(where[2]), entry = plan.layers[l];
        const at = where ?? [this.centre.x, this.centre.y, (entry.z_bottom + entry.z_top) / 2];
        const target = new THREE.Vector3(at[0], at[1], at[2] + this.shift(l));
        this.pin.visible = Boolean(where);
        this.pin.position.copy(target);
        this.pinLabel.textContent = text ?? '';
        this.boundaries.forEach(({lines, label}, k) => {
            for (const line of lines.children) line.material.color.set(k === l && !where ? '#d97500' : '#17636b');
            label.classList.toggle('pin', k === l && !where);
        });
        const way = this.camera.position.clone().sub(this.controls.target);
        this.controls.target.copy(target);
        this.camera.position.copy(target).add(stay ? way : way.setLength(where ? this.size * 1.1 : this.size * 2.1));
        this.controls.update();
        this.say(text ?? `${layerName(l)}: ${figure(entry.z_bottom, 3)} to ${figure(entry.z_top, 3)} mm, ${entry.reason}`);
        Object.assign(this.stage.dataset, {layer: String(l), operation: operation === undefined ? '' : String(operation), place: at.map(v => Number(v).toFixed(3)).join(',')});
        this.draw();
    }
}

// Loops with parents as one flat shape that faces up or down.
function capOf(loops, up) {
    const unit = data.outlines.unit_mm, points = loops.map(({points: flat}) => {
        const list = [];
        for (let i = 0; i < flat.length; i += 2) list.push(new THREE.Vector2(flat[i] * unit, flat[i + 1] * unit));
        return list;
    });
    const depth = loops.map((_, i) => { let d = 0; for (let k = loops[i].parent; k >= 0; k = loops[k].parent) ++d; return d; });
    const position = [];
    loops.forEach((loop, i) => {
        if (depth[i] % 2 || points[i].length < 3) return;
        const holes = loops.flatMap((other, k) => other.parent === i && points[k].length >= 3 ? [points[k].slice()] : []), contour = points[i].slice();
        const all = [contour, ...holes].flat();
        for (const triangle of THREE.ShapeUtils.triangulateShape(contour, holes)) {
            const [a, b, c] = triangle.map(k => all[k]);
            const left = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x) > 0;
            for (const p of left === up ? [a, b, c] : [a, c, b]) position.push(p.x, p.y, 0);
        }
    });
    if (position.length === 0) return null;
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.Float32BufferAttribute(position, 3));
    geometry.computeVertexNormals();
    return geometry;
}

// The loop around loop i, of loops that come without saying: the smallest that holds its first point.
function parentOf(i, loops) {
    const [px, py] = loops[i];
    let best = -1, least = Infinity;
    loops.forEach((points, k) => {
        if (k === i) return;
        let inside = false, area = 0;
        for (let a = points.length - 2, b = 0; b < points.length; a = b, b += 2) {
            area += points[a] * points[b + 1] - points[b] * points[a + 1];
            if ((points[a + 1] > py) !== (points[b + 1] > py) && px < (points[b] - points[a]) * (py - points[a + 1]) / (points[b + 1] - points[a + 1]) + points[a]) inside = !inside;
        }
        if (inside && Math.abs(area) < least) { least = Math.abs(area); best = k; }
    });
    return best;
}

// Boxes as one body, each larger by `more` to all sides, so that what they fill does not shimmer through.
function boxGeometry(boxes, more) {
    const position = new Float32Array(24 * boxes.length), index = new Uint32Array(36 * boxes.length);
    const faces = [0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4, 2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5];
    boxes.forEach((b, i) => {
        for (let k = 0; k < 8; ++k) position.set([k & 1 ? b.x1 + more : b.x0 - more, k & 2 ? b.y1 + more : b.y0 - more, k & 4 ? b.z1 : b.z0], 24 * i + 3 * k);
        for (let k = 0; k < 36; ++k) index[36 * i + k] = 8 * i + faces[k];
    });
    const indexed = new THREE.BufferGeometry();
    indexed.setAttribute('position', new THREE.BufferAttribute(position, 3));
    indexed.setIndex(new THREE.BufferAttribute(index, 1));
    const geometry = indexed.toNonIndexed();
    geometry.computeVertexNormals();
    return geometry;
}

const mostPlates = 30000;
function plates(heights, nx) {
    let count = 0;
    for (let c = 0; c < heights.length; ++c) if (heights[c] > 0 && (c % nx === 0 || heights[c] !== heights[c - 1])) ++count;
    return count;
}

// The wood of layer l: its upper side, walls where it ends, and its underside, with what is milled from below taken out. Cells with nothing are left out.
function woodGeometry(l) {
    const {nx, ny, x0, y0, cell_mm: cell} = data.stock, floors = woodFloors(l);
    // A relief has another height in every cell: then heights a little apart are one.
    let heights = woodHeights(l);
    for (let step = 2; step <= 8 && plates(heights, nx) > mostPlates; step *= 2) heights = heights.map(h => h === 0 || h === 255 ? h : Math.min(254, Math.max(1, Math.round(h / step) * step)));
    // A cell's wood from its floor to its height in one number; 0 where nothing stands.
    const wood = c => { const h = heights[c], f = floors ? floors[c] : 0; return h > f ? f * 256 + h : 0; };
    const position = [], at = (i, j) => i >= 0 && j >= 0 && i < nx && j < ny ? wood(j * nx + i) : 0;
    const floorOf = a => a >> 8, heightOf = a => a & 255, z = byte => woodTop(l, byte);
    const quad = (a, b, c, d) => position.push(...a, ...b, ...c, ...a, ...c, ...d);
    // What of a's side shows beside b.
    const exposed = (a, b, put) => {
        if (a === 0 || a === b) return;
        const f = floorOf(a), h = heightOf(a);
        if (b === 0) { put(z(f), z(h)); return; }
        if (floorOf(b) > f) put(z(f), z(Math.min(h, floorOf(b))));
        if (heightOf(b) < h) put(z(Math.max(f, heightOf(b))), z(h));
    };
    const half = cell / 2;
    // Neighbours in a row that are alike are one plate.
    for (let j = 0; j < ny; ++j)
        for (let i = 0; i < nx;) {
            const a = at(i, j);
            let end = i + 1;
            while (end < nx && at(end, j) === a) ++end;
            if (a > 0) {
                const top = z(heightOf(a)), bottom = z(floorOf(a)), xa = x0 + i * cell - half, xb = x0 + (end - 1) * cell + half, ya = y0 + j * cell - half, yb = ya + cell;
                quad([xa, ya, top], [xb, ya, top], [xb, yb, top], [xa, yb, top]);
                quad([xa, ya, bottom], [xa, yb, bottom], [xb, yb, bottom], [xb, ya, bottom]);
                exposed(a, at(i - 1, j), (low, high) => quad([xa, yb, high], [xa, yb, low], [xa, ya, low], [xa, ya, high]));
                exposed(a, at(end, j), (low, high) => quad([xb, ya, high], [xb, ya, low], [xb, yb, low], [xb, yb, high]));
            }
            i = end;
        }
    // Walls to the rows before and behind, joined while both stay the same.
    for (let j = 0; j <= ny; ++j) {
        const y = y0 + j * cell - half;
        for (let i = 0; i < nx;) {
            const a = at(i, j - 1), b = at(i, j);
            let end = i + 1;
            while (end < nx && at(end, j - 1) === a && at(end, j) === b) ++end;
            const xa = x0 + i * cell - half, xb = x0 + (end - 1) * cell + half;
            exposed(b, a, (low, high) => quad([xa, y, low], [xb, y, low], [xb, y, high], [xa, y, high]));
            exposed(a, b, (low, high) => quad([xb, y, low], [xa, y, low], [xa, y, high], [xb, y, high]));
            i = end;
        }
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.Float32BufferAttribute(position, 3));
    geometry.computeVertexNormals();
    return geometry;
}

// Cutter, shank and holder, the tip at the origin.
function cutterMeshes(tool) {
    const steel = new THREE.MeshLambertMaterial({color: '#7d8790', transparent: true, opacity: 0.85}), edge = new THREE.MeshLambertMaterial({color: '#d3a017', transparent: true, opacity: 0.8});
    const holder = new THREE.MeshLambertMaterial({color: '#4b535b', transparent: true, opacity: 0.55});
    const turned = (profile, material) => {
        const mesh = new THREE.Mesh(new THREE.LatheGeometry(profile.map(([r, z]) => new THREE.Vector2(r, z)), 36), material);
        mesh.rotation.x = Math.PI / 2;
        return mesh;
    };
    const r = tool.diameter / 2, flute = tool.flute_length, shank = tool.shank_diameter / 2, stick = tool.holder.stickout, nose = tool.holder.diameter / 2, end = [];
    if (tool.kind === 'drill' || tool.kind === 'cone') end.push([0, 0], [r, r / Math.tan((tool.point_deg || 118) / 2 * Math.PI / 180)]);
    else if (tool.kind === 'tapered-ball') {
        const corner = tool.corner_radius, taper = tool.taper_deg * Math.PI / 180, turned = Math.PI / 2 - taper;
        for (let k = 0; k <= 10; ++k) end.push([corner * Math.sin(k * turned / 10), corner * (1 - Math.cos(k * turned / 10))]);
        end.push([r, corner * (1 - Math.sin(taper)) + (r - corner * Math.cos(taper)) / Math.tan(taper)]);
    } else {
        const corner = tool.kind === 'ball' ? r : tool.corner_radius || 0;
        end.push([0, 0]);
        for (let k = 0; k <= 10; ++k) end.push([r - corner + corner * Math.sin(k * Math.PI / 20), corner * (1 - Math.cos(k * Math.PI / 20))]);
    }
    const meshes = [turned([...end, [r, flute], [0, flute]], edge), turned([[0, flute], [shank, flute], [shank, Math.max(flute, stick)], [0, Math.max(flute, stick)]], steel)];
    const profile = tool.holder.profile || [25, 2 * nose, 2 * nose], around = [[0, stick]];
    let above = stick;
    for (let k = 0; k + 2 < profile.length; k += 3) {
        around.push([profile[k + 1] / 2, above], [profile[k + 2] / 2, above + profile[k]]);
        above += profile[k];
    }
    meshes.push(turned([...around, [0, above]], holder));
    return meshes;
}

globalThis.slabwrightView = {mount};
