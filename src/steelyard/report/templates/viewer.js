"use strict";
// Draws the parts with WebGL2: no library, nothing loaded. Without WebGL the flat picture in the page stays.
(() => {
  const source = document.getElementById("scene");
  const root = document.getElementById("viewer");
  if (!source || !root) return;
  const canvas = root.querySelector("canvas");
  const gl = canvas.getContext("webgl2", { antialias: true, alpha: true, premultipliedAlpha: true });
  if (!gl) return;
  const data = JSON.parse(source.textContent);
  const marks = data.marks;
  const chips = root.querySelector(".chips");

  // --- small linear algebra; matrices are 16 numbers, columns first -------------------------------------------------
  const add = (a, b, k = 1) => [a[0] + k * b[0], a[1] + k * b[1], a[2] + k * b[2]];
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const crossed = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const unit = (a) => { const n = Math.hypot(...a) || 1; return [a[0] / n, a[1] / n, a[2] / n]; };
  const times = (a, b) => {
    const out = new Float32Array(16);
    for (let c = 0; c < 4; c++) for (let r = 0; r < 4; r++)
      for (let k = 0; k < 4; k++) out[4 * c + r] += a[4 * k + r] * b[4 * c + k];
    return out;
  };
  // Columns u, v, w and origin o as one matrix.
  const framed = (u, v, w, o) => [...u, 0, ...v, 0, ...w, 0, ...o, 1];

  // --- programs ----------------------------------------------------------------------------------------------------
  const vertexSource = `#version 300 es
    layout(location=0) in vec3 place; layout(location=1) in vec3 normal; layout(location=2) in vec3 colour;
    uniform mat4 model, view, projection; uniform float pointSize;
    out vec3 vPlace, vNormal, vColour, vOwn, vWorld;
    void main() {
      vec4 world = model * vec4(place, 1.0); vec4 seen = view * world;
      vWorld = world.xyz; vPlace = seen.xyz; vOwn = place; vColour = colour;
      vNormal = mat3(view) * (inverse(transpose(mat3(model))) * normal);
      gl_Position = projection * seen; gl_PointSize = pointSize;
    }`;
  const fragmentSource = `#version 300 es
    precision highp float;
    in vec3 vPlace, vNormal, vColour, vOwn, vWorld;
    uniform vec3 paint; uniform float alpha, ownColour, glow, cut; uniform vec3 cutWay; uniform int kind; uniform float dark;
    out vec4 result;
    vec3 linear(vec3 c) { return pow(c, vec3(2.2)); }
    void main() {
      if (kind != 1 && dot(vWorld, cutWay) > cut) discard;
      vec3 base = linear(mix(paint, vColour, ownColour));
      if (kind == 2) {                                       // the centre of mass: quarters of dark and light
        vec3 s = step(0.0, vOwn); base = mod(s.x + s.y + s.z, 2.0) > 0.5 ? vec3(0.012) : vec3(0.95);
      }
      if (kind == 3) {                                       // points of the cloud
        if (length(gl_PointCoord - 0.5) > 0.5) discard;
        result = vec4(pow(base, vec3(1.0 / 2.2)) * alpha, alpha); return;
      }
      vec3 v = normalize(-vPlace), n = normalize(vNormal);
      bool inside = kind == 0 && !gl_FrontFacing;
      if (inside) {                                          // the wall behind the cut, as if it were filled
        vec3 c = base * 0.62 * (0.92 + 0.08 * step(0.5, fract((gl_FragCoord.x + gl_FragCoord.y) / 9.0)));
        result = vec4(pow(c, vec3(1.0 / 2.2)) * alpha, alpha); return;
      }
      if (dot(n, v) < 0.0) n = -n;
      vec3 key = normalize(vec3(-0.5, 0.75, 0.62)), fill = normalize(vec3(0.85, 0.05, 0.45)), back = normalize(vec3(0.2, 0.5, -0.9));
      float sky = 0.5 + 0.5 * n.y;
      vec3 light = mix(vec3(0.17, 0.16, 0.155), vec3(0.40, 0.43, 0.47), sky);
      light += vec3(1.02, 0.98, 0.92) * pow(max(dot(n, key), 0.0) * 0.86 + 0.14 * max(dot(n, key) + 0.4, 0.0), 1.15) * 0.98;
      light += vec3(0.55, 0.62, 0.72) * max(dot(n, fill), 0.0) * 0.28;
      light += vec3(0.8) * max(dot(n, back), 0.0) * 0.22;
      vec3 h = normalize(key + v);
      float f = pow(1.0 - max(dot(n, v), 0.0), 4.0);
      float shine = pow(max(dot(n, h), 0.0), 42.0) * 0.26 + pow(max(dot(n, normalize(fill + v)), 0.0), 18.0) * 0.05;
      vec3 c = base * light + shine + f * mix(0.05, 0.16, dark) * mix(vec3(0.6, 0.7, 0.8), base, 0.3);
      c = mix(c, c + vec3(0.16, 0.12, 0.04), glow);
      c = c * (1.0 + c * 0.08) / (1.0 + c * 0.24);
      result = vec4(pow(c, vec3(1.0 / 2.2)) * alpha, alpha);
    }`;
  const compiled = (type, text) => { const s = gl.createShader(type); gl.shaderSource(s, text); gl.compileShader(s); return s; };
  const program = gl.createProgram();
  gl.attachShader(program, compiled(gl.VERTEX_SHADER, vertexSource));
  gl.attachShader(program, compiled(gl.FRAGMENT_SHADER, fragmentSource));
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) return;
  gl.useProgram(program);
  const at = new Proxy({}, { get: (known, name) => (name in known ? known[name] : (known[name] = gl.getUniformLocation(program, name))) });

  // --- buffers -----------------------------------------------------------------------------------------------------
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const packedBuffer = (raw, indices) => {
    const array = gl.createVertexArray(); gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer()); gl.bufferData(gl.ARRAY_BUFFER, raw, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(0); gl.vertexAttribPointer(0, 3, gl.UNSIGNED_SHORT, true, 16, 0);
    gl.enableVertexAttribArray(1); gl.vertexAttribPointer(1, 3, gl.BYTE, true, 16, 8);
    gl.enableVertexAttribArray(2); gl.vertexAttribPointer(2, 3, gl.UNSIGNED_BYTE, true, 16, 12);
    if (indices) {
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
    }
    return array;
  };
  // Plain triangles: places and normals as six numbers each.
  const plainBuffer = (numbers) => {
    const array = gl.createVertexArray(); gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer()); gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(numbers), gl.STATIC_DRAW);
    gl.enableVertexAttribArray(0); gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 24, 0);
    gl.enableVertexAttribArray(1); gl.vertexAttribPointer(1, 3, gl.FLOAT, false, 24, 12);
    return { array, count: numbers.length / 6 };
  };
  // A surface over a grid of (u, v) in 0..1.
  const swept = (nu, nv, shape) => {
    const out = [];
    for (let i = 0; i < nu; i++) for (let j = 0; j < nv; j++) {
      const [a, b, c, d] = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]].map(([u, v]) => shape(u / nu, v / nv));
      out.push(...a, ...b, ...c, ...a, ...c, ...d);
    }
    return plainBuffer(out);
  };
  const turn = 2 * Math.PI;
  const sphere = swept(32, 20, (u, v) => {
    const [s, c, t, k] = [Math.sin(turn * u), Math.cos(turn * u), Math.sin(Math.PI * v), Math.cos(Math.PI * v)];
    return [c * t, s * t, k, c * t, s * t, k];
  });
  // An arrow along z of length 1: shaft, then head.
  const arrow = swept(20, 4, (u, v) => {
    const [r, z] = [[0, 0], [0.022, 0], [0.022, 0.8], [0.065, 0.8], [0, 1]][Math.round(4 * v)];
    const [s, c] = [Math.sin(turn * u), Math.cos(turn * u)];
    return [c * r, s * r, z, c, s, 0.3];
  });
  // A thin ring around the ellipse with half axes a and b.
  const ring = (a, b, thick) => {
    const normal = unit(crossed(a, b));
    return swept(72, 6, (u, v) => {
      const [s, c] = [Math.sin(turn * u), Math.cos(turn * u)];
      const out = unit(add(add([0, 0, 0], a, c / (dot(a, a) || 1)), b, s / (dot(b, b) || 1)));
      const way = add(add([0, 0, 0], out, Math.cos(turn * v)), normal, Math.sin(turn * v));
      return [...add(add(add([0, 0, 0], a, c), b, s), way, thick), ...way];
    });
  };

  const size = data.size;
  const box = { low: [Infinity, Infinity, Infinity], high: [-Infinity, -Infinity, -Infinity] };
  const bodies = data.bodies.map((body) => {
    const raw = bytes(body.vertices), indices = new Uint32Array(bytes(body.indices).buffer);
    const shares = new Uint16Array(raw.buffer), count = raw.length / 16, places = new Float32Array(3 * count);
    for (let i = 0; i < count; i++) for (let k = 0; k < 3; k++) {
      const p = data.low[k] + (size * shares[8 * i + k]) / 65535;
      places[3 * i + k] = p; box.low[k] = Math.min(box.low[k], p); box.high[k] = Math.max(box.high[k], p);
    }
    return { ...body, places, indices, array: packedBuffer(raw, indices), shown: true };
  });
  const points = data.points && { count: data.points.count, array: packedBuffer(bytes(data.points.vertices)) };
  const middle = add(box.low, add(box.high, box.low, -1), 0.5);
  const [right0, up0, toward0] = data.view;
  // Some places of every part: what the first look must hold.
  const some = bodies.flatMap((body) => {
    const step = 3 * Math.max(1, Math.floor(body.places.length / 3 / 240)), out = [];
    for (let i = 0; i < body.places.length; i += step) out.push([body.places.slice(i, i + 3), body.middle]);
    return out;
  });
  const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((k) => [0, 1, 2].map((i) => (k >> i & 1 ? box.high : box.low)[i]));
  const reach = Math.max(...corners.map((c) => Math.hypot(...add(c, middle, -1))));
  const rings = marks.ellipsoid ? [[0, 1], [1, 2], [2, 0]].map(([i, j]) => ring(marks.ellipsoid[i], marks.ellipsoid[j], 0.003 * size)) : [];

  // --- state -------------------------------------------------------------------------------------------------------
  const start = { yaw: -0.49, pitch: 0.38, zoom: 1, pan: [0, 0, 0] };
  const eye = { ...start };
  const grasps = marks.grasps ? marks.grasps.rows : [];
  const show = { com: "com" in marks, sensor: "sensor" in marks, grasps: grasps.length > 0, ellipsoid: !!marks.open && rings.length > 0, chips: true, points: false };
  let mode = "parts", explode = 0, cut = 0, lit = null, wanted = false;
  const night = window.matchMedia("(prefers-color-scheme: dark)");
  const redraw = () => { if (!wanted) { wanted = true; requestAnimationFrame(draw); } };

  const axes = () => {
    const [sy, cy, sp, cp] = [Math.sin(eye.yaw), Math.cos(eye.yaw), Math.sin(eye.pitch), Math.cos(eye.pitch)];
    const right = add(add([0, 0, 0], right0, cy), toward0, sy);
    const flat = add(add([0, 0, 0], right0, -sy), toward0, cy);
    const toward = add(add([0, 0, 0], flat, cp), up0, sp);
    return { right, up: crossed(toward, right), toward };
  };
  const offset = (body) => add([0, 0, 0], add(body.middle, middle, -1), 1.3 * explode);
  const view = () => {
    const { right, up, toward } = axes(), aspect = canvas.clientWidth / Math.max(canvas.clientHeight, 1), tangent = 0.24;
    // As near as the parts, pulled apart or not, allow.
    let distance = 0;
    const held = some.map(([c, centre]) => add(c, add(centre, middle, -1), 1.3 * explode));
    if (show.ellipsoid && marks.ellipsoid)
      for (const [i, j] of [[0, 1], [1, 2], [2, 0]]) for (let k = 0; k < 12; k++)
        held.push(add(add(marks.com, marks.ellipsoid[i], Math.cos((turn * k) / 12)), marks.ellipsoid[j], Math.sin((turn * k) / 12)));
    if (show.sensor && marks.sensor && Math.hypot(...add(marks.sensor.at, middle, -1)) < 4 * reach)
      for (const a of marks.sensor.axes) held.push(add(marks.sensor.at, a, 0.22 * size));
    if (show.grasps) for (const g of grasps) for (const a of g.axes) held.push(add(g.at, a, 0.13 * size));
    const ends = [0, 1, 2].map((k) => held.reduce(([l, h], c) => [Math.min(l, c[k]), Math.max(h, c[k])], [Infinity, -Infinity]));
    const centre = ends.map(([l, h]) => (l + h) / 2);
    for (const c of held) {
      const p = add(c, centre, -1), z = dot(p, toward);
      distance = Math.max(distance, Math.abs(dot(p, right)) / (tangent * aspect) + z, Math.abs(dot(p, up)) / tangent + z);
    }
    distance = (1.1 * distance) / eye.zoom;
    const target = add(centre, eye.pan), from = add(target, toward, distance);
    const rows = [right[0], up[0], toward[0], 0, right[1], up[1], toward[1], 0, right[2], up[2], toward[2], 0,
      -dot(right, from), -dot(up, from), -dot(toward, from), 1];
    const near = Math.max(distance - 4 * reach, 0.02 * distance), far = distance + 4 * reach;
    const lens = [1 / (tangent * aspect), 0, 0, 0, 0, 1 / tangent, 0, 0, 0, 0, -(far + near) / (far - near), -1,
      0, 0, (-2 * far * near) / (far - near), 0];
    return { rows, lens, all: times(lens, rows), from, right, up, toward, distance, tangent, aspect };
  };

  // --- drawing -----------------------------------------------------------------------------------------------------
  const paintOf = (body) => {
    const text = mode === "dense" ? body.dense : body.colour;
    return [1, 3, 5].map((i) => parseInt(text.slice(i, i + 2), 16) / 255);
  };
  const mesh = (model, paint, alpha, kind) => {
    gl.uniformMatrix4fv(at.model, false, model);
    gl.uniform3fv(at.paint, paint); gl.uniform1f(at.alpha, alpha); gl.uniform1i(at.kind, kind);
  };
  const draw = () => {
    wanted = false;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const [w, h] = [Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio)];
    if (!w || !h) return;
    if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
    const seen = view();
    gl.viewport(0, 0, w, h); gl.clearColor(0, 0, 0, 0); gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST); gl.depthFunc(gl.LEQUAL); gl.disable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.uniformMatrix4fv(at.view, false, seen.rows); gl.uniformMatrix4fv(at.projection, false, seen.lens);
    gl.uniform1f(at.dark, night.matches ? 1 : 0); gl.uniform1f(at.pointSize, 3 * ratio);
    const way = toward0, places = corners.map((c) => dot(c, way));
    const [lowest, highest] = [Math.min(...places), Math.max(...places)];
    gl.uniform3fv(at.cutWay, way);
    gl.uniform1f(at.cut, cut > 0 ? highest - cut * (highest - lowest) : 1e9);
    gl.uniform1f(at.ownColour, mode === "true" ? 1 : 0);
    const shown = bodies.filter((b) => b.shown);
    for (const body of shown) {
      const faint = lit !== null && lit !== body.label;
      gl.uniform1f(at.glow, lit === body.label ? 1 : 0);
      mesh(framed([1, 0, 0], [0, 1, 0], [0, 0, 1], offset(body)), paintOf(body), 1, 0);
      // Places are shares of the box: the model matrix scales them back.
      gl.uniformMatrix4fv(at.model, false, framed([size, 0, 0], [0, size, 0], [0, 0, size], add(data.low, offset(body))));
      if (faint) { gl.enable(gl.BLEND); gl.uniform1f(at.alpha, 0.6); } else gl.disable(gl.BLEND);
      gl.bindVertexArray(body.array); gl.drawElements(gl.TRIANGLES, body.count, gl.UNSIGNED_INT, 0);
    }
    gl.uniform1f(at.glow, 0);
    if (points && show.points) {
      gl.uniform1f(at.ownColour, 1);
      mesh(framed([size, 0, 0], [0, size, 0], [0, 0, size], data.low), [0, 0, 0], 1, 3);
      gl.bindVertexArray(points.array); gl.drawArrays(gl.POINTS, 0, points.count);
    }
    gl.uniform1f(at.ownColour, 0);
    // What lies inside is seen through the walls, faintly.
    gl.enable(gl.BLEND);
    if (show.com && marks.com) {
      gl.disable(gl.DEPTH_TEST);
      drawn(sphere, framed(...marks.spread.axes, marks.com), [0.9, 0.66, 0.22], 0.32, 1);
      gl.enable(gl.DEPTH_TEST);
    }
    if (show.grasps) {
      gl.disable(gl.DEPTH_TEST);
      for (const g of grasps) if (g.spread[2].some((v) => v)) drawn(sphere, framed(...g.spread, g.at), [0.9, 0.66, 0.22], 0.4, 1);
      gl.enable(gl.DEPTH_TEST);
    }
    for (const [test, strength, write] of [[gl.GREATER, 0.5, false], [gl.LEQUAL, 1, true]]) {
      gl.depthFunc(test); gl.depthMask(write);
      drawMarks(seen, strength);
    }
    gl.depthMask(true); gl.depthFunc(gl.LEQUAL);
    label(seen, shown);
  };
  const drawn = (thing, model, paint, alpha, kind) => {
    mesh(model, paint, alpha, kind); gl.bindVertexArray(thing.array); gl.drawArrays(gl.TRIANGLES, 0, thing.count);
  };
  const tint = [[0.82, 0.27, 0.18], [0.18, 0.58, 0.36], [0.2, 0.45, 0.8]];
  const drawFrame = (frame, l, strength) => frame.axes.forEach((z, k) => {
    const x = unit(crossed(Math.abs(z[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0], z)), y = crossed(z, x);
    const scaled = (a) => add([0, 0, 0], a, l);
    drawn(arrow, framed(scaled(x), scaled(y), scaled(z), frame.at), tint[k], strength, 1);
  });
  const drawMarks = (seen, strength) => {
    if (show.sensor && marks.sensor) drawFrame(marks.sensor, 0.2 * size, strength);
    if (show.grasps) for (const g of grasps) drawFrame(g, 0.12 * size, strength);
    if (!marks.com) return;
    if (show.ellipsoid) for (const thing of rings)
      drawn(thing, framed([1, 0, 0], [0, 1, 0], [0, 0, 1], marks.com), [0.86, 0.62, 0.2], 0.9 * strength, 1);
    if (show.com) {
      const depth = dot(add(seen.from, marks.com, -1), seen.toward);
      const r = (10 * 2 * seen.tangent * depth) / canvas.clientHeight;
      drawn(sphere, framed([r, 0, 0], [0, r, 0], [0, 0, r], marks.com), [1, 1, 1], Math.min(1, 1.7 * strength), 2);
    }
  };

  // --- labels ------------------------------------------------------------------------------------------------------
  const chipOf = (text, kind) => {
    const chip = document.createElement("span"); chip.textContent = text; chip.className = kind; chips.append(chip); return chip;
  };
  for (const body of bodies) body.chip = chipOf(body.says ? `${body.name} ${body.says}` : body.name, "");
  const tips = marks.sensor ? ["x", "y", "z"].map((name, k) => {
    const chip = chipOf(name, "axis"); chip.style.color = `var(--${name})`;
    return { chip, place: add(marks.sensor.at, marks.sensor.axes[k], 0.225 * size) };
  }) : [];
  const onScreen = (seen, p) => {
    const m = seen.all, w = m[3] * p[0] + m[7] * p[1] + m[11] * p[2] + m[15];
    const [x, y] = [0, 1].map((r) => (m[r] * p[0] + m[4 + r] * p[1] + m[8 + r] * p[2] + m[12 + r]) / w);
    return [(0.5 + 0.5 * x) * canvas.clientWidth, (0.5 - 0.5 * y) * canvas.clientHeight];
  };
  const label = (seen, shown) => {
    const taken = [];
    for (const body of bodies) body.chip.hidden = !(show.chips && body.shown && (shown.length <= 12 || lit === body.label));
    for (const body of shown) {
      if (body.chip.hidden) continue;
      const [at, y] = onScreen(seen, add(body.middle, offset(body)));
      const [w, h] = [body.chip.offsetWidth, body.chip.offsetHeight];
      const wide = chips.clientWidth;  // a name is whole at the picture's edge too, and leaves with its part
      const x = at < 0 || at > wide ? at : Math.max(w / 2, Math.min(at, wide - w / 2));
      let top = y + 16;
      while (taken.some(([l, t, r]) => x - w / 2 < r && x + w / 2 > l && Math.abs(t - top) < h + 2)) top += 3;
      taken.push([x - w / 2, top, x + w / 2]);
      body.chip.style.transform = `translate(${(x - w / 2).toFixed(1)}px, ${top.toFixed(1)}px)`;
    }
    for (const { chip, place } of tips) {
      chip.hidden = !show.sensor;
      const [x, y] = onScreen(seen, place);
      chip.style.transform = `translate(${(x - 4).toFixed(1)}px, ${(y - 10).toFixed(1)}px)`;
    }
  };

  // --- which part is under the pointer -----------------------------------------------------------------------------
  const under = (clientX, clientY) => {
    const frame = canvas.getBoundingClientRect(), seen = view();
    const u = (2 * (clientX - frame.left)) / frame.width - 1, v = 1 - (2 * (clientY - frame.top)) / frame.height;
    const way = unit(add(add(add([0, 0, 0], seen.toward, -1), seen.right, u * seen.tangent * seen.aspect), seen.up, v * seen.tangent));
    let best = Infinity, found = null;
    for (const body of bodies) {
      if (!body.shown) continue;
      const from = add(seen.from, offset(body), -1), p = body.places, t = body.indices;
      for (let i = 0; i < t.length; i += 3) {
        const [a, b, c] = [3 * t[i], 3 * t[i + 1], 3 * t[i + 2]];
        const e1x = p[b] - p[a], e1y = p[b + 1] - p[a + 1], e1z = p[b + 2] - p[a + 2];
        const e2x = p[c] - p[a], e2y = p[c + 1] - p[a + 1], e2z = p[c + 2] - p[a + 2];
        const hx = way[1] * e2z - way[2] * e2y, hy = way[2] * e2x - way[0] * e2z, hz = way[0] * e2y - way[1] * e2x;
        const det = e1x * hx + e1y * hy + e1z * hz;
        if (det <= 1e-18) continue;
        const sx = from[0] - p[a], sy = from[1] - p[a + 1], sz = from[2] - p[a + 2];
        const s = sx * hx + sy * hy + sz * hz;
        if (s < 0 || s > det) continue;
        const qx = sy * e1z - sz * e1y, qy = sz * e1x - sx * e1z, qz = sx * e1y - sy * e1x;
        const r = way[0] * qx + way[1] * qy + way[2] * qz;
        if (r < 0 || s + r > det) continue;
        const far = (e2x * qx + e2y * qy + e2z * qz) / det;
        if (far > 0 && far < best) { best = far; found = body.label; }
      }
    }
    return found;
  };
  const light = (part) => {
    if (part === lit) return;
    lit = part;
    for (const row of root.querySelectorAll(".legend li")) row.classList.toggle("lit", row.dataset.label === String(part));
    redraw();
  };

  // --- hands -------------------------------------------------------------------------------------------------------
  const turnBy = (dx, dy) => {
    eye.yaw -= 0.008 * dx; eye.pitch = Math.max(-1.55, Math.min(1.55, eye.pitch + 0.008 * dy)); redraw();
  };
  const moveBy = (dx, dy) => {
    const seen = view(), k = (2 * seen.tangent * seen.distance) / canvas.clientHeight;
    eye.pan = add(add(eye.pan, seen.right, -dx * k), seen.up, dy * k); redraw();
  };
  const zoomBy = (factor) => { eye.zoom = Math.max(0.3, Math.min(30, eye.zoom * factor)); redraw(); };
  const hands = new Map();
  const spread = () => {
    const [a, b] = [...hands.values()];
    return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, far: Math.hypot(a.x - b.x, a.y - b.y) };
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId); hands.set(event.pointerId, { x: event.clientX, y: event.clientY });
  });
  let looking = false;
  canvas.addEventListener("pointermove", (event) => {
    const hand = hands.get(event.pointerId);
    if (!hand) {
      if (!looking) { looking = true; requestAnimationFrame(() => { looking = false; light(under(event.clientX, event.clientY)); }); }
      return;
    }
    const before = hands.size === 2 ? spread() : null;
    const [dx, dy] = [event.clientX - hand.x, event.clientY - hand.y];
    hand.x = event.clientX; hand.y = event.clientY;
    if (before) {
      const after = spread();
      moveBy(after.x - before.x, after.y - before.y); zoomBy(after.far / (before.far || 1));
    } else if (event.shiftKey || event.buttons & 6) moveBy(dx, dy);
    else turnBy(dx, dy);
  });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (event) => hands.delete(event.pointerId));
  canvas.addEventListener("pointerleave", () => light(null));
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => { event.preventDefault(); zoomBy(Math.exp(-0.0015 * event.deltaY)); }, { passive: false });
  const reset = () => {
    Object.assign(eye, start, { pan: [0, 0, 0] }); explode = cut = 0;
    for (const slide of root.querySelectorAll("input[type=range]")) slide.value = 0;
    redraw();
  };
  canvas.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: [-18, 0], ArrowRight: [18, 0], ArrowUp: [0, -18], ArrowDown: [0, 18] }[event.key];
    if (step) (event.shiftKey ? moveBy : turnBy)(...step);
    else if (event.key === "+" || event.key === "=") zoomBy(1.15);
    else if (event.key === "-") zoomBy(1 / 1.15);
    else if (event.key === "0" || event.key === "Home") reset();
    else return;
    event.preventDefault();
  });

  // --- controls ----------------------------------------------------------------------------------------------------
  const hint = root.querySelector(".hint");
  const note = () => {
    const said = [], times = (larger) => (larger > 1 ? `, drawn ${larger} times larger` : "");
    if (show.com && marks.spread && marks.spread.larger) said.push(`of the centre of mass${times(marks.spread.larger)}`);
    if (show.grasps && marks.grasps) said.push(`of the grasps' places${times(marks.grasps.larger)}`);
    hint.hidden = !said.length;
    hint.textContent = `95 % ellipsoid${said.length > 1 ? "s" : ""} ${said.join("; ")}`;
  };
  for (const button of root.querySelectorAll("[data-mode]")) button.addEventListener("click", () => {
    mode = button.dataset.mode;
    for (const other of root.querySelectorAll("[data-mode]")) other.setAttribute("aria-pressed", String(other === button));
    const scale = root.querySelector(".dense"); if (scale) scale.hidden = mode !== "dense";
    redraw();
  });
  for (const button of root.querySelectorAll("[data-show]")) {
    const key = button.dataset.show;
    button.setAttribute("aria-pressed", String(show[key]));
    button.addEventListener("click", () => {
      show[key] = !show[key]; button.setAttribute("aria-pressed", String(show[key])); note(); redraw();
    });
  }
  for (const slide of root.querySelectorAll("[data-slide]")) slide.addEventListener("input", () => {
    if (slide.dataset.slide === "explode") explode = slide.value / 100; else cut = slide.value / 100;
    redraw();
  });
  for (const button of root.querySelectorAll("[data-do=reset]")) button.addEventListener("click", reset);
  for (const box of root.querySelectorAll("[data-part]")) {
    box.hidden = false;
    box.addEventListener("change", () => {
      for (const body of bodies) if (String(body.label) === box.dataset.part) body.shown = box.checked;
      redraw();
    });
  }
  for (const row of root.querySelectorAll(".legend li")) {
    row.addEventListener("pointerenter", () => light(Number(row.dataset.label)));
    row.addEventListener("pointerleave", () => light(null));
  }
  canvas.hidden = false; root.querySelector(".controls").hidden = false; root.querySelector(".still").setAttribute("hidden", "");
  note();
  new ResizeObserver(redraw).observe(canvas);
  night.addEventListener("change", redraw);
  redraw();
})();
