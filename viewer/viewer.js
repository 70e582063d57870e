// The map of report.html and of the page of seastitch-page: one canvas. Coordinates are north and
// east [m] in the reference system of the map; heights are positive up.
'use strict';
const seastitchViewer = (() => {
  const root = document.getElementById('viewer');
  let map = null;  // made by map_data.cpp
  let vehicle = null;  // where the vehicle is, see showVehicle()
  const find = (name) => root.querySelector(`[data-part=${name}]`);
  const canvas = find('map'), context = canvas.getContext('2d');
  const layerChoice = find('layer'), split = find('split'), readout = find('readout');
  const overlays = [...root.querySelectorAll('input[type=checkbox]')];
  const layerOptions = [...layerChoice.options];
  let rasters = {};  // by name: values [m], NaN where there is none
  let pictures = {};  // by name: canvas of one pixel a cell, north up
  const view = {east: 0, north: 0, scale: 1};  // middle of the canvas, pixels per metre
  let marked = null;  // north, east of the last click
  let isMoved = false;  // by the person: the view stays where it is

  const kDifferenceColours =
      [[33, 102, 172], [146, 197, 222], [247, 247, 247], [244, 165, 130], [178, 24, 43]];

  // What can be shown: the rasters left and right of the slider, colours and unit of its values.
  const kLayers = {
    depth: {before: 'elevation_before', after: 'elevation', scale: 'depth', factor: -1, unit: 'm', relief: true},
    difference: {after: 'difference', scale: 'difference', factor: 100, unit: 'cm'},
    mismatch: {before: 'mismatch_before', after: 'mismatch', scale: 'mismatch', factor: 100, unit: 'cm'},
    uncertainty: {after: 'uncertainty', scale: 'mismatch', factor: 100, unit: 'cm'},
  };

  const coloursOf = (layer) =>
      (layer.scale === 'difference' ? kDifferenceColours : map.colours[layer.scale]);

  // Values are 16-bit numbers, 0 for none: of each row the differences, first all low bytes, then
  // all high bytes; compressed by zlib.
  async function decode(raster, map) {
    const packed = Uint8Array.from(atob(raster.data), (c) => c.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('deflate'));
    const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
    const cells = map.rows * map.cols, values = new Float32Array(cells);
    let code = 0;
    for (let i = 0; i < cells; ++i) {
      if (i % map.cols === 0) code = 0;
      code = (code + bytes[i] + 256 * bytes[cells + i]) & 0xffff;
      values[i] = code === 0 ? NaN : raster.lowest + (code - 1) * raster.step;
    }
    return values;
  }

  const limitsOf = (layer) => {
    const all = [];
    for (const name of [layer.before, layer.after])
      if (name && rasters[name])
        for (const value of rasters[name]) if (!Number.isNaN(value)) all.push(value * layer.factor);
    if (all.length === 0) return [0, 1];
    all.sort((a, b) => a - b);
    const at = (share) => all[Math.round(share * (all.length - 1))];
    if (layer === kLayers.difference) {
      const most = Math.max(-at(0.01), at(0.99), 1);
      return [-most, most];
    }
    if (layer !== kLayers.depth) return [0, Math.max(at(0.98), 1)];
    return [at(0.005), Math.max(at(0.995), at(0.005) + 0.1)];
  };

  // Light from the north-west, twice the real relief.
  function shadeOf(values, row, col) {
    const at = (r, c) => {
      const inside = r >= 0 && r < map.rows && c >= 0 && c < map.cols;
      return inside ? values[r * map.cols + c] : NaN;
    };
    const here = at(row, col);
    const or = (value) => (Number.isNaN(value) ? here : value);
    const north = (or(at(row + 1, col)) - or(at(row - 1, col))) / map.cell_m;
    const east = (or(at(row, col + 1)) - or(at(row, col - 1))) / map.cell_m;
    const lit = (1 - 0.7 * north + 0.7 * east) / Math.hypot(1, north, east) / Math.SQRT2;
    return Math.min(1.25, Math.max(0.35, 0.35 + 0.92 * lit));
  }

  function pictureOf(name, layer) {
    const values = rasters[name], [low, high] = layer.limits, colours = coloursOf(layer);
    const picture = document.createElement('canvas');
    picture.width = map.cols;
    picture.height = map.rows;
    const pixels = new ImageData(map.cols, map.rows);
    for (let row = 0; row < map.rows; ++row)
      for (let col = 0; col < map.cols; ++col) {
        const value = values[row * map.cols + col];
        if (Number.isNaN(value)) continue;
        const share = Math.min(1, Math.max(0, (value * layer.factor - low) / (high - low)));
        const place = share * (colours.length - 1);
        const k = Math.min(colours.length - 2, Math.floor(place)), w = place - k;
        const shade = layer.relief ? shadeOf(values, row, col) : 1;
        const at = 4 * ((map.rows - 1 - row) * map.cols + col);
        for (let c = 0; c < 3; ++c)
          pixels.data[at + c] = shade * ((1 - w) * colours[k][c] + w * colours[k + 1][c]);
        pixels.data[at + 3] = 255;
      }
    picture.getContext('2d').putImageData(pixels, 0, 0);
    return picture;
  }

  const toScreen = (north, east) => [
    (east - view.east) * view.scale + canvas.clientWidth / 2,
    canvas.clientHeight / 2 - (north - view.north) * view.scale];
  const toMap = (x, y) => [
    view.north - (y - canvas.clientHeight / 2) / view.scale,
    view.east + (x - canvas.clientWidth / 2) / view.scale];

  function drawRaster(name, fromX, toX) {
    if (!name || !pictures[name] || toX <= fromX) return;
    const [left, bottom] = toScreen(map.north_m, map.east_m);
    const width = map.cols * map.cell_m * view.scale, height = map.rows * map.cell_m * view.scale;
    context.save();
    context.beginPath();
    context.rect(fromX, 0, toX - fromX, canvas.clientHeight);
    context.clip();
    context.imageSmoothingEnabled = map.cell_m * view.scale < 2;
    context.drawImage(pictures[name], left, bottom - height, width, height);
    context.restore();
  }

  function drawLine(points, colour, width, close) {
    context.beginPath();
    for (let i = 0; i + 1 < points.length; i += 2) context.lineTo(...toScreen(points[i], points[i + 1]));
    if (close) context.closePath();
    context.strokeStyle = colour;
    context.lineWidth = width;
    context.stroke();
  }

  // An arrow in a circle of 1 sigma, and a cross where dead reckoning alone has the vehicle.
  function drawVehicle() {
    drawLine(vehicle.trail, 'rgba(20,20,25,.95)', 1.4);
    const [x, y] = toScreen(vehicle.north_m, vehicle.east_m);
    context.beginPath();
    context.arc(x, y, Math.max(1, vehicle.sigma_m * view.scale), 0, 2 * Math.PI);
    context.fillStyle = 'rgba(200,69,60,.18)';
    context.fill();
    if (vehicle.navigated) {
      const [cx, cy] = toScreen(...vehicle.navigated);
      context.beginPath();
      for (const [dx, dy] of [[5, 5], [5, -5]]) {
        context.moveTo(cx - dx, cy - dy);
        context.lineTo(cx + dx, cy + dy);
      }
      context.strokeStyle = 'rgba(190,70,40,.95)';
      context.lineWidth = 2;
      context.stroke();
    }
    context.save();
    context.translate(x, y);
    context.rotate(vehicle.heading_deg * Math.PI / 180);
    context.beginPath();
    for (const [dx, dy] of [[0, -11], [7, 8], [0, 4], [-7, 8]]) context.lineTo(dx, dy);
    context.closePath();
    context.fillStyle = '#c8453c';
    context.strokeStyle = '#fff';
    context.lineWidth = 1.5;
    context.fill();
    context.stroke();
    context.restore();
  }

  const isOn = (name) => overlays.some((box) => box.name === name && box.checked);
  const splitX = () => (split.hidden ? 0 : canvas.clientWidth * split.value / 100);

  function drawOverlays() {
    if (isOn('submaps')) for (const s of map.submaps) drawLine(s.outline, 'rgba(90,90,100,.7)', 1, true);
    if (isOn('closures'))
      for (const closure of map.closures)
        drawLine(closure.line, closure.used ? 'rgba(220,30,90,.6)' : 'rgba(120,120,130,.5)', 1);
    if (isOn('track')) {
      for (const line of map.track_before) drawLine(line, 'rgba(190,70,40,.9)', 1);
      // With a pale edge, to be seen on dark ground too.
      for (const line of map.track) drawLine(line, 'rgba(255,255,255,.7)', 3);
      for (const line of map.track) drawLine(line, 'rgba(20,20,25,.95)', 1.4);
    }
    if (vehicle) drawVehicle();
    if (marked) {
      const [x, y] = toScreen(...marked);
      context.beginPath();
      context.arc(x, y, 6, 0, 2 * Math.PI);
      context.strokeStyle = '#c8453c';
      context.lineWidth = 2;
      context.stroke();
    }
  }

  // A round length of about a fifth of the width, and north, which is up.
  function drawScale(ink) {
    const metres = canvas.clientWidth / view.scale / 5;
    const power = 10 ** Math.floor(Math.log10(metres));
    const length = power * (metres >= 5 * power ? 5 : metres >= 2 * power ? 2 : 1);
    const y = canvas.clientHeight - 16, x = 14;
    context.strokeStyle = context.fillStyle = ink;
    context.lineWidth = 2;
    context.beginPath();
    context.moveTo(x, y - 5);
    context.lineTo(x, y);
    context.lineTo(x + length * view.scale, y);
    context.lineTo(x + length * view.scale, y - 5);
    context.stroke();
    context.font = '12px "DejaVu Sans", system-ui, sans-serif';
    context.fillText(length >= 1000 ? `${length / 1000} km` : `${length} m`, x + 4, y - 8);
    context.beginPath();
    context.moveTo(24, 34);
    context.lineTo(18, 50);
    context.lineTo(24, 46);
    context.lineTo(30, 50);
    context.closePath();
    context.fill();
    context.fillText('N', 20, 28);
  }

  // The border between both maps, and which is which.
  function drawSplit(x, ink) {
    context.fillStyle = ink;
    if (x < canvas.clientWidth) context.fillRect(x - 1, 0, 2, canvas.clientHeight);
    context.font = '13px "DejaVu Sans", system-ui, sans-serif';
    context.textAlign = 'right';
    context.fillText('as navigated', x - 8, 20);
    context.textAlign = 'left';
    if (x < canvas.clientWidth) context.fillText('delivered map', x + 8, 20);
  }

  function draw() {
    if (!map) return;
    const ratio = window.devicePixelRatio || 1;
    const width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, {width, height});
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, canvas.clientWidth, canvas.clientHeight);
    const layer = kLayers[layerChoice.value], x = splitX();
    drawRaster(layer.before, 0, x);
    drawRaster(layer.after, x, canvas.clientWidth);
    drawOverlays();
    const ink = getComputedStyle(root).color;
    if (x > 0) drawSplit(x, ink);
    drawScale(ink);
  }

  const digits = (layer) => (layer.unit === 'm' ? 1 : 0);
  function chooseLayer() {
    const layer = kLayers[layerChoice.value];
    find('slider').hidden = split.hidden = !layer.before || !rasters[layer.before];
    const [low, high] = layer.limits;
    find('low').textContent = `${low.toFixed(digits(layer))} ${layer.unit}`;
    find('high').textContent = `${high.toFixed(digits(layer))} ${layer.unit}`;
    find('bar').style.background = `linear-gradient(to right, ${
        coloursOf(layer).map((c) => `rgb(${c.map(Math.round)})`)})`;
    draw();
  }

  function valueAt(name, north, east) {
    const row = Math.floor((north - map.north_m) / map.cell_m);
    const col = Math.floor((east - map.east_m) / map.cell_m);
    const inside = rasters[name] && row >= 0 && row < map.rows && col >= 0 && col < map.cols;
    return inside ? rasters[name][row * map.cols + col] : NaN;
  }

  function isInside(outline, north, east) {
    let inside = false;
    for (let i = 0, j = outline.length - 2; i < outline.length; j = i, i += 2) {
      const crosses = outline[i] > north !== outline[j] > north;
      if (crosses && east < outline[i + 1] + (outline[j + 1] - outline[i + 1]) *
                              (north - outline[i]) / (outline[j] - outline[i]))
        inside = !inside;
    }
    return inside;
  }

  function tellAbout(north, east) {
    const parts = [`north ${north.toFixed(1)} m, east ${east.toFixed(1)} m`];
    const add = (text, name, factor, unit, places) => {
      const value = valueAt(name, north, east);
      if (!Number.isNaN(value)) parts.push(`${text} ${(value * factor).toFixed(places)} ${unit}`);
    };
    add('depth', 'elevation', -1, 'm', 2);
    add('\u00b1', 'uncertainty', 1, 'm (1 sigma)', 2);
    add('as navigated', 'elevation_before', -1, 'm', 2);
    add('swath mismatch', 'mismatch', 100, 'cm', 0);
    const submaps = map.submaps.filter((s) => isInside(s.outline, north, east)).map((s) => s.id);
    if (submaps.length > 0) parts.push(`submap ${submaps.join(', ')}`);
    readout.textContent = parts.join(' \u00b7 ');
    marked = [north, east];
    draw();
  }

  function showAll() {
    const height = map.rows * map.cell_m, width = map.cols * map.cell_m;
    view.north = map.north_m + height / 2;
    view.east = map.east_m + width / 2;
    view.scale = 0.96 * Math.min(canvas.clientWidth / width, canvas.clientHeight / height);
    draw();
  }

  function showWhole() {
    isMoved = false;
    showAll();
  }

  // Zooms about a point of the canvas.
  function zoom(factor, x = canvas.clientWidth / 2, y = canvas.clientHeight / 2) {
    isMoved = true;
    const [north, east] = toMap(x, y);
    view.scale = Math.min(500, Math.max(1e-3, view.scale * factor));
    const [after_north, after_east] = toMap(x, y);
    view.north += north - after_north;
    view.east += east - after_east;
    draw();
  }

  function move(x, y) {
    isMoved = true;
    view.east -= x / view.scale;
    view.north += y / view.scale;
    draw();
  }

  const touches = new Map();  // by pointer: its place on the canvas
  let travelled = 0;
  canvas.addEventListener('pointerdown', (event) => {
    canvas.setPointerCapture(event.pointerId);
    touches.set(event.pointerId, [event.offsetX, event.offsetY]);
    if (touches.size === 1) travelled = 0;
  });
  canvas.addEventListener('pointermove', (event) => {
    const before = touches.get(event.pointerId);
    if (!before) return;
    const now = [event.offsetX, event.offsetY];
    const other = [...touches].find(([id]) => id !== event.pointerId);
    touches.set(event.pointerId, now);
    const away = ([x, y]) => Math.hypot(x - other[1][0], y - other[1][1]);
    travelled += Math.hypot(now[0] - before[0], now[1] - before[1]);
    if (other && away(before) > 0) return zoom(away(now) / away(before), ...other[1]);
    move(now[0] - before[0], now[1] - before[1]);
  });
  canvas.addEventListener('pointerup', (event) => {
    if (touches.delete(event.pointerId) && travelled < 5) tellAbout(...toMap(event.offsetX, event.offsetY));
  });
  canvas.addEventListener('pointercancel', (event) => touches.delete(event.pointerId));
  canvas.addEventListener('wheel', (event) => {
    event.preventDefault();
    zoom(Math.exp(-0.0015 * event.deltaY), event.offsetX, event.offsetY);
  }, {passive: false});
  canvas.addEventListener('keydown', (event) => {
    const step = 40;
    const actions = {
      ArrowLeft: () => move(step, 0), ArrowRight: () => move(-step, 0),
      ArrowUp: () => move(0, step), ArrowDown: () => move(0, -step),
      '+': () => zoom(1.3), '-': () => zoom(1 / 1.3), 0: showWhole,
      Enter: () => tellAbout(view.north, view.east),
    };
    if (!actions[event.key]) return;
    event.preventDefault();
    actions[event.key]();
  });
  find('closer').addEventListener('click', () => zoom(1.3));
  find('farther').addEventListener('click', () => zoom(1 / 1.3));
  find('whole').addEventListener('click', showWhole);
  split.addEventListener('input', draw);
  layerChoice.addEventListener('change', chooseLayer);
  for (const box of overlays) box.addEventListener('change', draw);
  window.addEventListener('resize', draw);
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', draw);

  // Shows a map in place of the one before.
  async function show(data) {
    const decoded = {};
    await Promise.all(data.rasters.map(async (raster) => (decoded[raster.name] = await decode(raster, data))));
    if (decoded.elevation && decoded.elevation_before)
      decoded.difference = decoded.elevation.map((value, i) => value - decoded.elevation_before[i]);
    [map, rasters, pictures] = [data, decoded, {}];
    const chosen = layerChoice.value;
    layerChoice.replaceChildren(...layerOptions.filter((o) => rasters[kLayers[o.value].after]));
    if (rasters[kLayers[chosen].after]) layerChoice.value = chosen;
    for (const layer of Object.values(kLayers)) {
      if (!rasters[layer.after]) continue;
      layer.limits = limitsOf(layer);
      for (const raster of [layer.before, layer.after])
        if (rasters[raster]) pictures[raster] = pictureOf(raster, layer);
    }
    root.hidden = false;
    if (!isMoved) showAll();
    chooseLayer();
    root.dataset.ready = 'yes';
  }

  // A vehicle: north_m, east_m, sigma_m, heading_deg; navigated: north, east by dead reckoning, or
  // null; trail: its track since the map was made.
  function showVehicle(state) {
    vehicle = state;
    draw();
  }

  return {show, showVehicle};
})();

for (const button of document.querySelectorAll('button[data-copy]'))
  button.addEventListener('click', () => navigator.clipboard.writeText(button.dataset.copy)
      .then(() => (button.textContent = 'copied')));

// In report.html the map is an element of the page. Without a browser that can unpack the rasters,
// the pictures stay.
if (document.getElementById('map-data'))
  seastitchViewer.show(JSON.parse(document.getElementById('map-data').textContent))
      .then(() => (document.getElementById('pictures').hidden = true))
      .catch((error) => (document.getElementById('viewer-problem').textContent =
                             `The map cannot be drawn here (${error.message}); the pictures show it.`));
