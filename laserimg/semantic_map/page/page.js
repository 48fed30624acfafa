"use strict";
const map = JSON.parse(document.getElementById("map").textContent);
const view = document.getElementById("view"), names = document.getElementById("names");
const gl = view.getContext("webgl2", { antialias: false, alpha: false });

// Points: x, y, z of 16 bits, then the cluster of 16 bits, then brightness and size of 8 bits.
const count = map.count;
const bytes = Uint8Array.from(atob(document.getElementById("points").textContent), c => c.charCodeAt(0));
const LOOSE = 0, GROUND = 1, FIRST = 2;
const labelOf = code => code === LOOSE ? "loose" : code === GROUND ? "ground" : map.clusters[code - FIRST].class;
const hidden = new Set();

// ---- camera -------------------------------------------------------------------------------------------------
const FOV = 0.85;
const camera = { target: [0, 0, 0], distance: 50, yaw: -2.2, pitch: 0.6 };
function home() {
  // From the side of the scanner, where surfaces show the side that it saw.
  const [x, y] = [0, 1].map(k => map.scanners[0][k] - map.middle[k]);
  if (Math.hypot(x, y) > 0.3 * map.radius) camera.yaw = Math.atan2(y, x) + 0.25;
  Object.assign(camera, { target: map.middle.slice(), distance: map.radius * 1.6, pitch: 0.8 });
}
function eye() {
  const { target: t, distance: r, yaw, pitch } = camera;
  return [t[0] + r * Math.cos(pitch) * Math.cos(yaw), t[1] + r * Math.cos(pitch) * Math.sin(yaw),
    t[2] + r * Math.sin(pitch)];
}
function axes() {
  const { yaw, pitch } = camera;
  const back = [Math.cos(pitch) * Math.cos(yaw), Math.cos(pitch) * Math.sin(yaw), Math.sin(pitch)];
  const right = [-Math.sin(yaw), Math.cos(yaw), 0];
  const up = [-Math.sin(pitch) * Math.cos(yaw), -Math.sin(pitch) * Math.sin(yaw), Math.cos(pitch)];
  return { right, up, back };
}
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const near = () => Math.max(0.05, camera.distance * 0.02), far = () => camera.distance + map.radius * 8;
function projection() {
  const { right, up, back } = axes(), e = eye(), n = near(), f = far();
  const h = 1 / Math.tan(FOV / 2), w = h * view.height / view.width;
  const a = (f + n) / (n - f), b = 2 * f * n / (n - f);
  const row = (axis, s) => [axis[0] * s, axis[1] * s, axis[2] * s, -dot(axis, e) * s];
  const x = row(right, w), y = row(up, h), z = row(back, 1);
  const m = new Float32Array(16);
  for (let i = 0; i < 4; i++) m.set([x[i], y[i], a * z[i] + (i === 3 ? b : 0), -z[i]], 4 * i);
  return m;
}

// ---- drawing ------------------------------------------------------------------------------------------------
const POINTS = [`#version 300 es
layout(location=0) in vec3 place; layout(location=1) in uint cluster;
layout(location=2) in float shade; layout(location=3) in float size;
uniform mat4 matrix; uniform vec3 low, span; uniform float pixels, largest; uniform highp sampler2D table;
out vec3 colour; flat out vec4 number;
void main() {
  vec4 entry = texelFetch(table, ivec2(int(cluster) & 1023, int(cluster) >> 10), 0);
  gl_Position = matrix * vec4(low + span * place, 1.0);
  gl_PointSize = clamp(size * largest * pixels / gl_Position.w, 1.6, 28.0);
  if (entry.a < 0.5) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  colour = entry.rgb * shade;
  number = vec4(float(cluster & 255u), float(cluster >> 8), 255.0, 255.0) / 255.0;
}`, `#version 300 es
precision mediump float;
in vec3 colour; flat in vec4 number;
layout(location=0) out vec4 drawn; layout(location=1) out vec4 told;
void main() {
  vec2 d = gl_PointCoord - 0.5;
  if (dot(d, d) > 0.25) discard;
  drawn = vec4(colour, 1.0); told = number;
}`];
// Eye-dome lighting (Boucheny 2009): a pixel is darker the farther it lies behind those around it.
const LIGHT = [`#version 300 es
void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }`, `#version 300 es
precision highp float;
uniform sampler2D picture, numbers, depths; uniform float near, far; uniform vec2 chosen; uniform int reach;
out vec4 drawn;
float away(ivec2 p) {
  float d = texelFetch(depths, p, 0).r;
  return d >= 1.0 ? 0.0 : log2(2.0 * near * far / (far + near - (2.0 * d - 1.0) * (far - near)));
}
bool isChosen(ivec2 p) {
  vec4 n = texelFetch(numbers, p, 0);
  return n.b > 0.5 && all(lessThan(abs(n.rg - chosen), vec2(0.001)));
}
void main() {
  ivec2 p = ivec2(gl_FragCoord.xy), size = textureSize(depths, 0);
  float own = away(p), sum = 0.0; int marked = 0;
  for (int k = 0; k < 8; k++) {
    float angle = float(k) * 0.7853982;
    ivec2 q = clamp(p + ivec2(round(vec2(cos(angle), sin(angle)) * float(reach))), ivec2(0), size - 1);
    float other = away(q);
    if (other > 0.0) sum += max(0.0, (own > 0.0 ? own : 12.0) - other);
    if (chosen.x >= 0.0 && isChosen(q)) marked++;
  }
  float height = float(p.y) / float(size.y);
  vec3 ground = mix(vec3(0.055, 0.065, 0.085), vec3(0.10, 0.12, 0.155), height);
  if (own > 0.0) ground = texelFetch(picture, p, 0).rgb * exp(-sum * 2.2);
  else if (sum > 0.0) ground *= 0.7;
  if (chosen.x >= 0.0) {
    if (isChosen(p)) ground = mix(ground, vec3(1.0), 0.22);
    else if (marked > 0) ground = vec3(1.0);
  }
  drawn = vec4(ground, 1.0);
}`];
function program(sources) {
  const made = gl.createProgram();
  sources.forEach((text, k) => {
    const shader = gl.createShader(k ? gl.FRAGMENT_SHADER : gl.VERTEX_SHADER);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(made, shader);
  });
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
  return new Proxy({}, { get: (_, name) => name === "use" ? () => gl.useProgram(made)
    : gl.getUniformLocation(made, name) });
}
let points, light, target, table;
function texture(inner, outer, kind) {
  const made = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, made);
  gl.texImage2D(gl.TEXTURE_2D, 0, inner, view.width, view.height, 0, outer, kind, null);
  for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, side, gl.NEAREST);
  return made;
}
function setUp() {
  points = program(POINTS); light = program(LIGHT);
  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ARRAY_BUFFER, bytes, gl.STATIC_DRAW);
  for (let k = 0; k < 4; k++) gl.enableVertexAttribArray(k);
  gl.vertexAttribPointer(0, 3, gl.UNSIGNED_SHORT, true, 6, 0);
  gl.vertexAttribIPointer(1, 1, gl.UNSIGNED_SHORT, 2, 6 * count);
  gl.vertexAttribPointer(2, 1, gl.UNSIGNED_BYTE, true, 1, 8 * count);
  gl.vertexAttribPointer(3, 1, gl.UNSIGNED_BYTE, true, 1, 9 * count);
  table = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, table);
  for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, side, gl.NEAREST);
  fillTable();
}
function fillTable() {
  const rows = Math.ceil((map.clusters.length + FIRST) / 1024), data = new Uint8Array(4096 * rows);
  for (let code = 0; code < map.clusters.length + FIRST; code++) {
    const label = labelOf(code);
    data.set([...map.colours[label], hidden.has(label) ? 0 : 255], 4 * code);
  }
  gl.bindTexture(gl.TEXTURE_2D, table);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 1024, rows, 0, gl.RGBA, gl.UNSIGNED_BYTE, data);
}
function resize() {
  const scale = Math.min(window.devicePixelRatio || 1, 2);
  const width = Math.max(1, Math.round(innerWidth * scale)), height = Math.max(1, Math.round(innerHeight * scale));
  if (target && view.width === width && view.height === height) return;
  for (const canvas of [view, names]) Object.assign(canvas, { width, height });
  if (target) { target.textures.forEach(t => gl.deleteTexture(t)); gl.deleteFramebuffer(target.buffer); }
  const textures = [texture(gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE), texture(gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE),
    texture(gl.DEPTH_COMPONENT24, gl.DEPTH_COMPONENT, gl.UNSIGNED_INT)];
  target = { textures, buffer: gl.createFramebuffer() };
  gl.bindFramebuffer(gl.FRAMEBUFFER, target.buffer);
  [gl.COLOR_ATTACHMENT0, gl.COLOR_ATTACHMENT1, gl.DEPTH_ATTACHMENT].forEach((place, k) =>
    gl.framebufferTexture2D(gl.FRAMEBUFFER, place, gl.TEXTURE_2D, textures[k], 0));
  gl.drawBuffers([gl.COLOR_ATTACHMENT0, gl.COLOR_ATTACHMENT1]);
}
let pinned = null, hovered = null, matrix = null;
function draw() {
  resize();
  matrix = projection();
  gl.bindFramebuffer(gl.FRAMEBUFFER, target.buffer);
  gl.viewport(0, 0, view.width, view.height);
  gl.enable(gl.DEPTH_TEST);
  gl.clearColor(0, 0, 0, 0);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  points.use();
  gl.uniformMatrix4fv(points.matrix, false, matrix);
  gl.uniform3fv(points.low, map.low);
  gl.uniform3fv(points.span, map.span);
  gl.uniform1f(points.largest, map.largest_m);
  gl.uniform1f(points.pixels, 1.25 * view.height / (2 * Math.tan(FOV / 2)));
  gl.activeTexture(gl.TEXTURE0);
  gl.bindTexture(gl.TEXTURE_2D, table);
  gl.uniform1i(points.table, 0);
  gl.drawArrays(gl.POINTS, 0, count);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  gl.disable(gl.DEPTH_TEST);
  light.use();
  ["picture", "numbers", "depths"].forEach((name, k) => {
    gl.activeTexture(gl.TEXTURE0 + k);
    gl.bindTexture(gl.TEXTURE_2D, target.textures[k]);
    gl.uniform1i(light[name], k);
  });
  const chosen = hovered ?? pinned;
  gl.uniform2f(light.chosen, chosen === null ? -1 : (chosen & 255) / 255, chosen === null ? -1 : (chosen >> 8) / 255);
  gl.uniform1f(light.near, near());
  gl.uniform1f(light.far, far());
  gl.uniform1i(light.reach, Math.max(1, Math.round(view.height / 700)));
  gl.drawArrays(gl.TRIANGLES, 0, 3);
  gl.activeTexture(gl.TEXTURE0);
  drawNames();
}
function onScreen(p) {
  const w = [0, 1, 3].map(k => matrix[k] * p[0] + matrix[4 + k] * p[1] + matrix[8 + k] * p[2] + matrix[12 + k]);
  return w[2] > near() ? [(0.5 + 0.5 * w[0] / w[2]) * view.width, (0.5 - 0.5 * w[1] / w[2]) * view.height, w[2]] : null;
}
function drawNames() {
  const pen = names.getContext("2d"), scale = view.width / innerWidth, taken = [];
  pen.clearRect(0, 0, names.width, names.height);
  map.scanners.forEach((p, k) => {
    const at = onScreen(p);
    if (!at) return;
    pen.strokeStyle = "#fff"; pen.lineWidth = 1.6 * scale;
    pen.beginPath(); pen.arc(at[0], at[1], 5 * scale, 0, 7); pen.stroke();
  });
  if (!document.getElementById("show-names").checked) return;
  pen.font = `${12 * scale}px system-ui, sans-serif`;
  pen.textAlign = "center";
  for (const k of map.named) {
    const cluster = map.clusters[k];
    if (hidden.has(cluster.class)) continue;
    const at = onScreen(cluster.top);
    if (!at) continue;
    const wide = pen.measureText(cluster.class).width / 2 + 5 * scale;
    const y = at[1] - 8 * scale, box = [at[0] - wide, y - 13 * scale, at[0] + wide, y + 4 * scale];
    if (taken.some(o => box[0] < o[2] && o[0] < box[2] && box[1] < o[3] && o[1] < box[3])) continue;
    taken.push(box);
    pen.fillStyle = "rgba(14, 17, 22, .72)";
    pen.fillRect(box[0], box[1], box[2] - box[0], box[3] - box[1]);
    pen.fillStyle = `rgb(${map.colours[cluster.class]})`;
    pen.fillText(cluster.class, at[0], y);
  }
}

// ---- what happens when ---------------------------------------------------------------------------------------
let waiting = false, turning = true, last = 0;
function redraw() { if (!waiting) { waiting = true; requestAnimationFrame(frame); } }
function frame(now) {
  waiting = false;
  if (turning) { camera.yaw += Math.min(now - last, 100) * 0.00012; redraw(); }
  last = now;
  draw();
}
function setTurning(on) {
  turning = on;
  document.getElementById("turn").setAttribute("aria-pressed", on);
  redraw();
}
function pick(x, y) {
  const scale = view.width / innerWidth, reach = 4, side = 2 * reach + 1, data = new Uint8Array(4 * side * side);
  gl.bindFramebuffer(gl.FRAMEBUFFER, target.buffer);
  gl.readBuffer(gl.COLOR_ATTACHMENT1);
  gl.readPixels(Math.round(x * scale) - reach, view.height - Math.round(y * scale) - reach, side, side,
    gl.RGBA, gl.UNSIGNED_BYTE, data);
  let best = null, nearest = Infinity;
  for (let k = 0; k < side * side; k++) {
    const code = data[4 * k] + 256 * data[4 * k + 1];
    const away = Math.hypot(k % side - reach, Math.floor(k / side) - reach);
    if (data[4 * k + 2] && code >= FIRST && away < nearest) { best = code; nearest = away; }
  }
  return best;
}
function element(tag, text, parent) {
  const made = document.createElement(tag);
  if (text !== undefined) made.textContent = text;
  if (parent) parent.append(made);
  return made;
}
function tell(code) {
  const card = document.getElementById("card");
  card.hidden = code === null;
  if (code === null) return;
  const cluster = map.clusters[code - FIRST], colour = `rgb(${map.colours[cluster.class]})`;
  card.replaceChildren();
  const title = element("h2", undefined, card), swatch = element("span", undefined, title);
  swatch.className = "swatch"; swatch.style.background = colour;
  title.append(`${cluster.class} ${cluster.confidence.toFixed(2)}`);
  const bar = element("div", undefined, card); bar.className = "bar";
  Object.assign(element("div", undefined, bar).style, { width: `${100 * cluster.confidence}%`, background: colour });
  const list = element("dl", undefined, card);
  for (const [term, text] of cluster.facts) { element("dt", term, list); element("dd", text, list); }
  element("p", cluster.why, card);
}
function look(event) {
  const found = pick(event.clientX, event.clientY);
  if (found === hovered) return;
  hovered = found;
  view.classList.toggle("picks", found !== null);
  tell(found ?? pinned);
  redraw();
}
function shift(dx, dy) {
  const { right, up } = axes(), metres = 2 * camera.distance * Math.tan(FOV / 2) / innerHeight;
  for (let k = 0; k < 3; k++) camera.target[k] -= (right[k] * dx - up[k] * dy) * metres;
}
function rotate(dx, dy) {
  camera.yaw -= dx * 0.006;
  camera.pitch = Math.min(1.57, Math.max(-0.35, camera.pitch + dy * 0.006));
}
function zoom(factor) { camera.distance = Math.min(map.radius * 6, Math.max(0.5, camera.distance * factor)); }
const fingers = new Map();
let moved = 0, shifting = false;
function down(event) {
  view.setPointerCapture(event.pointerId);
  fingers.set(event.pointerId, event);
  moved = 0;
  shifting = event.button > 0 || event.shiftKey || event.ctrlKey;
  setTurning(false);
  view.classList.add("drags");
}
function move(event) {
  const before = fingers.get(event.pointerId);
  if (!before) { if (event.pointerType === "mouse") look(event); return; }
  const dx = event.clientX - before.clientX, dy = event.clientY - before.clientY;
  moved += Math.abs(dx) + Math.abs(dy);
  if (fingers.size === 2) {
    const [other] = [...fingers].filter(([id]) => id !== event.pointerId).map(([, one]) => one);
    const span = one => Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY);
    zoom(span(before) / Math.max(span(event), 1));
    shift(dx / 2, dy / 2);
  } else if (shifting) shift(dx, dy);
  else rotate(dx, dy);
  fingers.set(event.pointerId, event);
  redraw();
}
function up(event) {
  const single = fingers.size === 1;
  fingers.delete(event.pointerId);
  view.classList.remove("drags");
  if (event.type === "pointerup" && single && moved < 6) { pinned = pick(event.clientX, event.clientY); hovered = null; tell(pinned); redraw(); }
}
function go(event) {
  const code = pick(event.clientX, event.clientY);
  if (code === null) return;
  const cluster = map.clusters[code - FIRST];
  camera.target = cluster.at.slice();
  camera.distance = Math.max(4, 2.5 * cluster.reach_m);
  redraw();
}
function key(event) {
  const turn = { ArrowLeft: [-12, 0], ArrowRight: [12, 0], ArrowUp: [0, 12], ArrowDown: [0, -12] }[event.key];
  if (turn) rotate(...turn);
  else if (event.key === "+" || event.key === "-") zoom(event.key === "+" ? 0.9 : 1 / 0.9);
  else if (event.key === "Escape") { pinned = hovered = null; tell(null); }
  else return;
  event.preventDefault();
  setTurning(false);
}
function fillLegend() {
  const box = document.getElementById("classes");
  for (const [label, number] of map.legend) {
    const row = element("label", undefined, box), tick = element("input", undefined, row);
    Object.assign(tick, { type: "checkbox", checked: true });
    const swatch = element("span", undefined, row); swatch.className = "swatch";
    swatch.style.background = `rgb(${map.colours[label]})`;
    element("span", label, row);
    element("span", number, row);
    tick.addEventListener("change", () => {
      if (tick.checked) hidden.delete(label); else hidden.add(label);
      row.classList.toggle("off", !tick.checked);
      fillTable();
      redraw();
    });
  }
}
function button(id, act) { document.getElementById(id).addEventListener("click", () => { act(); redraw(); }); }
function start() {
  setUp(); fillLegend(); home();
  view.addEventListener("pointerdown", down);
  view.addEventListener("pointermove", move);
  view.addEventListener("pointerup", up);
  view.addEventListener("pointercancel", up);
  view.addEventListener("dblclick", go);
  view.addEventListener("contextmenu", event => event.preventDefault());
  view.addEventListener("wheel", event => {
    event.preventDefault(); setTurning(false);
    zoom(Math.exp(Math.max(-60, Math.min(60, event.deltaY)) * 0.0025));
  }, { passive: false });
  view.addEventListener("keydown", key);
  addEventListener("resize", redraw);
  document.getElementById("show-names").addEventListener("change", redraw);
  button("above", () => { setTurning(false); home(); camera.pitch = 1.57; camera.yaw = -Math.PI / 2; });
  button("whole", home);
  button("turn", () => setTurning(!turning));
  button("scanner", () => {
    setTurning(false);
    Object.assign(camera, { target: map.scanners[0].slice(), distance: 2, pitch: 0.12 });
  });
  redraw();
}
if (gl) start(); else document.getElementById("sorry").hidden = false;
