"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const $ = (id) => document.getElementById(id);
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
  const nodes = new Float64Array(bytes(data.nodes)), members = new Int32Array(bytes(data.members));
  const triangles = new Int32Array(bytes(data.triangles));
  const scan = new Uint16Array(bytes(data.scan.points));
  const counts = { nodes: nodes.length / 3, members: members.length / 2, panels: data.loops ? data.loops.length : triangles.length / 3 };
  const owner = data.loops ? data.loops.flatMap((loop, k) => Array(loop.length - 2).fill(k)) : null; // the panel of each triangle
  const sides = (k) => { const loop = data.loops ? data.loops[k] : [0, 1, 2].map((j) => triangles[3 * k + j]); return loop.flatMap((v, j) => [v, loop[(j + 1) % loop.length]]); };
  const KINDS = ["nodes", "members", "panels"];
  const canvas = $("canvas"), gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
  if (!gl) { $("row").textContent = "This browser shows no 3D view (WebGL 2); the figures below hold all the same."; return; }

  // ---- colours
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const rising = () => dark.matches ? [[128, 104, 200], [84, 130, 190], [40, 165, 158], [94, 201, 98], [253, 231, 37]]
    : [[68, 1, 84], [59, 82, 139], [28, 125, 122], [70, 140, 50], [186, 120, 0]];
  const diverging = () => dark.matches ? [[255, 110, 110], [225, 150, 130], [160, 165, 170], [130, 180, 220], [90, 180, 255]]
    : [[178, 24, 43], [190, 95, 75], [110, 115, 120], [70, 125, 175], [33, 102, 172]];
  const ramp = (stops, t) => {
    const at = Math.min(Math.max(t, 0), 1) * (stops.length - 1), k = Math.min(Math.floor(at), stops.length - 2), f = at - k;
    return stops[k].map((c, j) => Math.round(c + (stops[k + 1][j] - c) * f));
  };
  const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const rgb = (name) => [1, 3, 5].map((k) => parseInt(css(name).padEnd(7, css(name).slice(1)).substr(k, 2), 16));
  const hex = (color) => [1, 3, 5].map((k) => parseInt(color.substr(k, 2), 16));
  const words = (value) => value === null || value === undefined ? "-" : typeof value === "number" ? String(+value.toPrecision(5)) : value;

  // ---- programs
  const HEAD = "#version 300 es\nprecision highp float;\n";
  const program = (vertex, fragment) => {
    const made = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, HEAD + text); gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw Error(gl.getShaderInfoLog(shader));
      gl.attachShader(made, shader);
    }
    gl.linkProgram(made);
    return { made, at: (name) => gl.getUniformLocation(made, name), of: (name) => gl.getAttribLocation(made, name) };
  };
  const flat = "in vec4 c; out vec4 o; void main() { o = c; }";
  const lines = program(`in vec2 corner; in vec3 a; in vec3 b; in vec4 color; uniform mat4 m; uniform vec2 size; uniform float wide, near;
    out vec4 c; void main() { vec4 p = m * vec4(a, 1.), q = m * vec4(b, 1.); float w0 = near;
    if (p.w < w0 && q.w > w0) p = mix(p, q, (w0 - p.w) / (q.w - p.w)); else if (q.w < w0 && p.w > w0) q = mix(q, p, (w0 - q.w) / (p.w - q.w));
    vec2 d = (q.xy / q.w - p.xy / p.w) * size; d = length(d) > 0. ? normalize(d) : vec2(1., 0.);
    vec4 r = corner.x < .5 ? p : q; r.xy += vec2(-d.y, d.x) * corner.y * wide / size * r.w; r.z -= 2e-4 * r.w; c = color; gl_Position = r; }`, flat);
  const dots = program(`in vec3 a; in vec4 color; uniform mat4 m; uniform float wide, lift; out vec4 c;
    void main() { gl_Position = m * vec4(a, 1.); gl_Position.z -= lift * gl_Position.w; gl_PointSize = wide; c = color; }`,
    "in vec4 c; out vec4 o; void main() { vec2 d = gl_PointCoord - .5; if (dot(d, d) > .25) discard; o = c; }");
  const faces = program(`in vec3 a; in vec4 color; uniform mat4 m; out vec4 c; out vec3 p; void main() { gl_Position = m * vec4(a, 1.); c = color; p = a; }`,
    `in vec4 c; in vec3 p; uniform float shade; uniform vec3 eye; out vec4 o; void main() { vec3 n = normalize(cross(dFdx(p), dFdy(p)));
    float l = abs(dot(n, normalize(eye - p))); o = vec4(c.rgb * mix(1., .55 + .45 * l, shade), 1.); }`);

  // ---- buffers, in the frame of the middle of the box
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  const grow = (k, value) => { low[k] = Math.min(low[k], value); high[k] = Math.max(high[k], value); };
  nodes.forEach((value, k) => grow(k % 3, value));
  if (scan.length) for (const end of [data.scan.low, data.scan.high]) end.forEach((value, k) => grow(k, value));
  const middle = low.map((value, k) => (value + high[k]) / 2), size = Math.hypot(...low.map((value, k) => high[k] - value)) || 1;
  const at = (node) => [0, 1, 2].map((k) => nodes[3 * node + k] - middle[k]);
  const buffer = (array) => { const b = gl.createBuffer(); gl.bindBuffer(gl.ARRAY_BUFFER, b); gl.bufferData(gl.ARRAY_BUFFER, array, gl.STATIC_DRAW); return b; };
  const places = {
    nodes: buffer(Float32Array.from(nodes, (value, k) => value - middle[k % 3])),
    members: buffer(new Float32Array(Array.from(members).flatMap(at))),
    panels: buffer(new Float32Array(Array.from(triangles).flatMap(at))),
    scan: buffer(Float32Array.from(scan, (value, k) => data.scan.low[k % 3] + value / 65535 * (data.scan.high[k % 3] - data.scan.low[k % 3]) - middle[k % 3])),
    corner: buffer(new Float32Array([0, -1, 0, 1, 1, -1, 1, 1])),
  };
  const each = { nodes: 1, members: 1, panels: 3 };
  const paint = (kind, color) => {
    const count = kind === "panels" ? triangles.length / 3 : counts[kind], out = new Uint8Array(4 * each[kind] * count);
    for (let k = 0; k < count; k++) for (let j = 0, c = color(kind === "panels" && owner ? owner[k] : k); j < each[kind]; j++) out.set(c, 4 * (k * each[kind] + j));
    return buffer(out);
  };
  const code = (kind) => (k) => { const n = k * 3 + KINDS.indexOf(kind) + 1; return [n & 255, n >> 8 & 255, n >> 16 & 255, 255]; };
  const codes = {}, colors = {};
  for (const kind of KINDS) codes[kind] = paint(kind, code(kind));

  // ---- camera
  const FOCAL = 1 / Math.tan(0.35), MARGIN = 0.94;
  let camera = { target: [0, 0, 0], distance: 1.4 * size, turn: -0.9, rise: 0.75 }, atHome = true;
  const axes = () => {
    const { turn, rise } = camera, back = [Math.cos(rise) * Math.cos(turn), Math.cos(rise) * Math.sin(turn), Math.sin(rise)];
    const right = [-Math.sin(turn), Math.cos(turn), 0];
    const up = [back[1] * right[2] - back[2] * right[1], back[2] * right[0] - back[0] * right[2], back[0] * right[1] - back[1] * right[0]];
    return { back, right, up };
  };
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const home = data.home ? data.home.map((place) => place.map((value, j) => value - middle[j])) : Array.from({ length: counts.nodes }, (_, k) => at(k));
  const goHome = () => { // as near as all nodes, or the bulk of a scan alone, fit into the view, in its middle
    camera = { target: [0, 0, 0], distance: 0.01 * size, turn: -0.9, rise: 0.75 }; atHome = true;
    const { back, right, up } = axes(), wide = canvas.width / canvas.height, fit = Math.min(1, wide) * FOCAL / MARGIN;
    for (let step = 0; step < 4; step++) {
      const each = home.map((place) => place.map((value, j) => value - camera.target[j]));
      const seen = each.map((p) => [dot(back, p), dot(right, p), dot(up, p)]);
      camera.distance = seen.reduce((most, [z, x, y]) => Math.max(most, z + Math.max(Math.abs(x) * fit / wide, Math.abs(y) * fit)), 0.01 * size);
      const middleOf = (j) => {
        const ends = seen.reduce(([a, b], p) => { const v = p[j] / (camera.distance - p[0]); return [Math.min(a, v), Math.max(b, v)]; }, [Infinity, -Infinity]);
        return home.length && step < 3 ? camera.distance * (ends[0] + ends[1]) / 2 : 0;
      };
      const x = middleOf(1), y = middleOf(2);
      camera.target = camera.target.map((value, j) => value + x * right[j] + y * up[j]);
    }
  };
  const view = () => {
    const { back, right, up } = axes(), eye = camera.target.map((value, k) => value + camera.distance * back[k]);
    const wide = canvas.width / canvas.height, f = FOCAL, fit = Math.min(1, wide);
    const near = Math.max(camera.distance - 1.5 * size, camera.distance * 0.01), far = camera.distance + 1.5 * size;
    const rows = [right.map((v) => v * f * fit / wide), up.map((v) => v * f * fit), back];
    const m = new Float32Array(16), p = (far + near) / (near - far), q = 2 * far * near / (near - far);
    for (let k = 0; k < 3; k++) { m[4 * k] = rows[0][k]; m[4 * k + 1] = rows[1][k]; m[4 * k + 2] = p * back[k]; m[4 * k + 3] = -back[k]; }
    m[12] = -dot(rows[0], eye); m[13] = -dot(rows[1], eye); m[14] = -p * dot(back, eye) + q; m[15] = dot(back, eye);
    return { m, eye, near };
  };

  // ---- drawing
  const bind = (which, name, source, width, options = {}) => {
    const place = which.of(name);
    gl.bindBuffer(gl.ARRAY_BUFFER, source); gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, width, options.bytes ? gl.UNSIGNED_BYTE : gl.FLOAT, !!options.bytes, options.stride || 0, options.offset || 0);
    gl.vertexAttribDivisor(place, options.each || 0);
    return place;
  };
  const shown = (name) => $("show-" + name).checked;
  const draw = (picking) => {
    const { m, eye, near } = view(), ratio = window.devicePixelRatio || 1, paints = picking ? codes : colors;
    const back = picking ? [0, 0, 0] : rgb("--view").map((v) => v / 255);
    gl.viewport(0, 0, canvas.width, canvas.height); gl.clearColor(...back, picking ? 0 : 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT); gl.enable(gl.DEPTH_TEST);
    const use = (which) => { gl.useProgram(which.made); gl.uniformMatrix4fv(which.at("m"), false, m); for (let k = 0; k < 8; k++) gl.disableVertexAttribArray(k); };
    const spots = (source, paintOf, count, wide, lift) => {
      use(dots); gl.uniform1f(dots.at("wide"), wide * ratio); gl.uniform1f(dots.at("lift"), lift); bind(dots, "a", source, 3);
      if (Array.isArray(paintOf)) gl.vertexAttrib4f(dots.of("color"), ...paintOf); else bind(dots, "color", paintOf, 4, { bytes: true });
      gl.drawArrays(gl.POINTS, 0, count);
    };
    const strokes = (source, paintOf, count, wide) => {
      use(lines); gl.uniform2f(lines.at("size"), canvas.width, canvas.height); gl.uniform1f(lines.at("wide"), wide * ratio);
      gl.uniform1f(lines.at("near"), near); bind(lines, "corner", places.corner, 2);
      bind(lines, "a", source, 3, { stride: 24, each: 1 }); bind(lines, "b", source, 3, { stride: 24, offset: 12, each: 1 });
      if (Array.isArray(paintOf)) gl.vertexAttrib4f(lines.of("color"), ...paintOf); else bind(lines, "color", paintOf, 4, { bytes: true, each: 1 });
      gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, count);
    };
    if (shown("panels")) {
      use(faces); gl.uniform1f(faces.at("shade"), picking ? 0 : 1); gl.uniform3f(faces.at("eye"), ...eye);
      bind(faces, "a", places.panels, 3); bind(faces, "color", paints.panels, 4, { bytes: true });
      gl.drawArrays(gl.TRIANGLES, 0, triangles.length);
    }
    if (!picking && shown("scan")) spots(places.scan, [...rgb("--dot").map((v) => v / 255), 1], scan.length / 3, 1.6, 1e-4);
    if (shown("members")) strokes(places.members, paints.members, counts.members, picking ? 8 : 2.6);
    if (shown("nodes")) spots(places.nodes, paints.nodes, counts.nodes, picking ? 13 : 7, 4e-4);
    if (!picking && selected) {
      const color = [...rgb("--pick").map((v) => v / 255), 1], [kind, k] = selected;
      if (kind === "nodes") { const one = buffer(new Float32Array(at(k))); spots(one, color, 1, 15, 1e-3); gl.deleteBuffer(one); }
      const ends = kind === "members" ? [members[2 * k], members[2 * k + 1]] : kind === "panels" ? sides(k) : [];
      if (ends.length) { const some = buffer(new Float32Array(ends.flatMap(at))); gl.depthFunc(gl.ALWAYS); strokes(some, color, ends.length / 2, 6); gl.depthFunc(gl.LESS); gl.deleteBuffer(some); }
    }
    if (!picking) pins(m);
  };
  let waiting = false;
  const redraw = () => { if (!waiting) { waiting = true; requestAnimationFrame(() => { waiting = false; draw(false); }); } };
  const resize = () => {
    const ratio = window.devicePixelRatio || 1;
    canvas.width = Math.max(1, Math.round(canvas.clientWidth * ratio)); canvas.height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (atHome) goHome();
    redraw();
  };

  // ---- colourings
  const column = (kind, name) => data.tables[kind].find((one) => one.name === name);
  const recolor = () => {
    const choice = data.colorings[+$("coloring").value] || {};
    const one = choice.kind && column(choice.kind, choice.name), known = one ? one.values.filter((v) => typeof v === "number") : [];
    let low = Infinity, high = -Infinity;
    for (const v of known) { low = Math.min(low, v); high = Math.max(high, v); }
    const [most, over] = choice.most && high > choice.most[0] ? choice.most : [Infinity, null];
    high = Math.min(high, most);
    if (choice.middle !== undefined) { const far = Math.max(high - choice.middle, choice.middle - low) || 1e-9; low = choice.middle - far; high = choice.middle + far; }
    const stops = choice.middle !== undefined ? diverging() : rising(), plain = { nodes: rgb("--wire"), members: rgb("--wire"), panels: rgb("--panel") };
    for (const kind of KINDS) {
      if (colors[kind]) gl.deleteBuffer(colors[kind]);
      colors[kind] = paint(kind, (k) => {
        const value = kind === choice.kind ? one.values[k] : null;
        return [...(value > most ? hex(over) : typeof value === "number" ? ramp(stops, high > low ? (value - low) / (high - low) : 0.5) : plain[kind]), 255];
      });
    }
    $("legend").hidden = !one || !known.length;
    if (one && known.length) {
      $("what").textContent = choice.words + (one.unit ? ` [${one.unit}]` : "");
      const decimals = Math.min(Math.max(2 - Math.floor(Math.log10(high - low || Math.abs(high) || 1) + 0.05), 0), 8);
      $("ramp").style.background = `linear-gradient(to right, ${stops.map((c, k) => `rgb(${c}) ${(over ? 90 : 100) * k / (stops.length - 1)}%`).join(",")}${over ? `, ${over} 90%` : ""})`;
      $("ends").replaceChildren(...[low, (low + high) / 2, high].map((v, k) => Object.assign(document.createElement("span"), { textContent: v.toFixed(decimals) + (over && k > 1 ? " and more" : "") })));
    }
    redraw();
  };

  // ---- selection
  let selected = null;
  const select = (kind, k) => {
    selected = kind === undefined ? null : [kind, k];
    const table = document.createElement("table");
    if (selected) for (const one of data.tables[kind]) {
      const row = table.insertRow(), head = row.appendChild(document.createElement("th"));
      head.textContent = one.unit ? `${one.name} [${one.unit}]` : one.name;
      row.insertCell().textContent = "xyz".includes(one.name) ? String(one.values[k]) : words(one.values[k]);
    }
    $("row").replaceChildren(selected ? table : "Click a node, member or panel, or type its mark.");
    redraw();
  };
  const pick = (x, y) => {
    const frame = gl.createFramebuffer(), target = gl.createTexture(), depth = gl.createRenderbuffer(), found = new Uint8Array(4);
    gl.bindTexture(gl.TEXTURE_2D, target); gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, canvas.width, canvas.height, 0, gl.RGBA, gl.UNSIGNED_BYTE, null);
    gl.bindRenderbuffer(gl.RENDERBUFFER, depth); gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT24, canvas.width, canvas.height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame); gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, target, 0);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, depth);
    draw(true);
    const ratio = canvas.width / canvas.clientWidth;
    gl.readPixels(Math.round(x * ratio), canvas.height - 1 - Math.round(y * ratio), 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, found);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null); gl.deleteFramebuffer(frame); gl.deleteTexture(target); gl.deleteRenderbuffer(depth);
    const n = found[3] ? found[0] + 256 * found[1] + 65536 * found[2] - 1 : -1;
    if (n < 0) select(); else select(KINDS[n % 3], Math.floor(n / 3));
  };

  // ---- pins of the certificate
  const fly = (place) => { atHome = false; camera.target = place.map((value, k) => value - middle[k]); camera.distance = Math.min(camera.distance, 8 * data.reach); redraw(); };
  const flags = data.places.map((place, k) => {
    const pin = Object.assign(document.createElement("button"), { className: "pin", textContent: k + 1, title: place.words, tabIndex: -1 });
    pin.onclick = () => fly(place.where);
    $("view").append(pin);
    return pin;
  });
  document.querySelectorAll("button.place").forEach((one) => { one.onclick = () => fly(data.places[+one.dataset.place].where); });
  const pins = (m) => flags.forEach((pin, k) => {
    const p = data.places[k].where.map((value, j) => value - middle[j]);
    const [x, y, , w] = [0, 1, 2, 3].map((j) => m[j] * p[0] + m[4 + j] * p[1] + m[8 + j] * p[2] + m[12 + j]);
    pin.hidden = !shown("pins") || w <= 0 || Math.abs(x) > w || Math.abs(y) > w;
    pin.style.left = `${(x / w + 1) / 2 * canvas.clientWidth}px`; pin.style.top = `${(1 - y / w) / 2 * canvas.clientHeight}px`;
  });

  // ---- mouse, touch and keys
  const orbit = (x, y) => { atHome = false; camera.turn -= x; camera.rise = Math.min(Math.max(camera.rise + y, -1.55), 1.55); redraw(); };
  const pan = (x, y) => { atHome = false; const { right, up } = axes(); camera.target = camera.target.map((value, k) => value + camera.distance * (y * up[k] - x * right[k])); redraw(); };
  const zoom = (factor) => { atHome = false; camera.distance = Math.min(Math.max(camera.distance * factor, 0.005 * size), 5 * size); redraw(); };
  const fingers = new Map();
  let moved = 0;
  canvas.onpointerdown = (event) => { fingers.set(event.pointerId, event); canvas.setPointerCapture(event.pointerId); if (fingers.size === 1) moved = 0; else moved = 99; };
  canvas.onpointermove = (event) => {
    const last = fingers.get(event.pointerId);
    if (!last) return;
    const x = event.clientX - last.clientX, y = event.clientY - last.clientY, scale = 1 / canvas.clientHeight;
    const other = [...fingers.values()].find((one) => one.pointerId !== event.pointerId);
    moved += Math.abs(x) + Math.abs(y);
    if (other) {
      const gap = (one) => Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY) || 1;
      zoom(gap(last) / gap(event)); pan(x * scale / 2, y * scale / 2);
    } else if (event.buttons & 2 || event.shiftKey) pan(0.73 * x * scale, 0.73 * y * scale); else orbit(4 * x * scale, 4 * y * scale);
    fingers.set(event.pointerId, event);
  };
  canvas.onpointerup = (event) => { fingers.delete(event.pointerId); if (moved < 5 && event.button === 0) { const box = canvas.getBoundingClientRect(); pick(event.clientX - box.left, event.clientY - box.top); } };
  canvas.onpointercancel = (event) => fingers.delete(event.pointerId);
  canvas.oncontextmenu = (event) => event.preventDefault();
  canvas.addEventListener("wheel", (event) => { event.preventDefault(); zoom(Math.exp(0.001 * event.deltaY)); }, { passive: false });
  canvas.onkeydown = (event) => {
    const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (way) (event.shiftKey ? pan : orbit)(0.08 * way[0], 0.08 * way[1]);
    else if (event.key === "+" || event.key === "=") zoom(0.85); else if (event.key === "-") zoom(1 / 0.85);
    else if (event.key === "Home") { goHome(); redraw(); } else if (event.key === "Escape") select(); else return;
    event.preventDefault();
  };
  $("mark").oninput = () => {
    const mark = $("mark").value.trim().toUpperCase();
    for (const kind of KINDS) { const k = data.tables[kind][0].values.findIndex((one) => String(one).toUpperCase() === mark); if (mark && k >= 0) { select(kind, k); return; } }
  };
  data.colorings.forEach((one, k) => $("coloring").append(new Option(one.words, k)));
  $("coloring").onchange = recolor;
  for (const name of ["scan", "panels", "members", "nodes", "pins"]) $("show-" + name).onchange = redraw;
  dark.addEventListener("change", recolor);
  new ResizeObserver(resize).observe(canvas);
  select(); recolor(); resize();
})();
