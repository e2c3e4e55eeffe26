// The bodies: shapes times coordinates, evaluated here and drawn by WebGL 2.

const VERTEX = `#version 300 es
in vec3 place; in float value; out vec3 seen; out float shade;
uniform mat3 turn; uniform vec3 centre; uniform vec3 zoom;
void main() {
  seen = turn * (place - centre);
  shade = value;
  gl_Position = vec4(seen * zoom, 1.0);
}`;
const FRAGMENT = `#version 300 es
precision highp float;
in vec3 seen; in float shade; out vec4 colour;
uniform sampler2D map; uniform vec2 range; uniform vec4 plain; uniform float solid; uniform float cover;
void main() {
  float at = clamp((shade - range.x) / (range.y - range.x), 0.0, 1.0);
  colour = plain.a > 0.0 ? plain : vec4(texture(map, vec2(at, 0.5)).rgb, 1.0);
  if (solid > 0.0) {
    vec3 normal = normalize(cross(dFdx(seen), dFdy(seen)));
    colour.rgb *= 0.5 + 0.5 * abs(dot(normal, vec3(0.2, 0.4, 0.9)));
  }
  colour.a = cover;
}`;

// Angles in degrees about the vertical axis of a body in space and then about that to the right, from
// the view along y; from below, what the ground would hide is seen.
const VIEWS = { oblique: [-35, 20], front: [0, 0], side: [-90, 0], above: [0, 90], below: [-20, -60] };

function shader(gl, kind, text) {
  const made = gl.createShader(kind);
  gl.shaderSource(made, text);
  gl.compileShader(made);
  return made;
}

// Rows (r, k) times coordinates q (k).
function times({ values }, count, q, out) {
  for (let r = 0, at = 0; r < count; r++) {
    let sum = 0;
    for (let k = 0; k < q.length; k++) sum += values[at++] * q[k];
    out[r] = sum;
  }
  return out;
}

// Components xx, yy, zz, xy, yz, zx lie at the places o; those that are zero everywhere have none.
function vonMises(s, at, o) {
  const part = (k) => o[k] < 0 ? 0 : s[at + o[k]];
  const xx = part(0), yy = part(1), zz = part(2), xy = part(3), yz = part(4), zx = part(5);
  return Math.sqrt(0.5 * ((xx - yy) * (xx - yy) + (yy - zz) * (yy - zz) + (zz - xx) * (zz - xx))
    + 3 * (xy * xy + yz * yz + zx * zx));
}

class Player {
  #width; #height; #centre; #limits; #drawn; #canvas; #below; #above; #under; #over; #faces; #edges; #buffers; #texture; #reaches; #feet;

  constructor(data, clock) {
    Object.assign(this, { data, clock, mode: -1, paint: data.bodies.paints[0], arrows: true, swing: 1 });
    const { bodies } = data;
    this.d = bodies.dimension;
    this.count = bodies.points.rows;
    this.scale = data.scale;
    // Coordinates of the modes, and behind them the products of nonlinear stress.
    this.q = new Float64Array(data.coordinates?.columns ?? bodies.modes.length);
    this.modal = this.q.subarray(0, bodies.modes.length);
    this.moved = new Float32Array(this.count * this.d);
    this.stress = new Float32Array(this.count * bodies.components.length);
    this.places = new Float32Array(3 * this.count);
    this.values = new Float32Array(this.count);
    if (this.d === 3) this.look("oblique"); else this.turn = [1, 0, 0, 0, 1, 0, 0, 0, 1];
    [this.#below, this.#canvas, this.#above] = [el("canvas"), el("canvas"), el("canvas")];
    this.node = el("div.stage", {}, this.#below, this.#canvas, this.#above);
    this.node.player = this;
    this.bar = new ColourBar();
    this.#canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    this.#canvas.addEventListener("webglcontextrestored", () => { if (!this.closed) { this.#begin(); this.draw(); } });
    this.#begin();
    this.#steer();
  }

  #begin() {
    const gl = this.gl = this.#canvas.getContext("webgl2", { antialias: true });
    if (!gl) {
      this.node.append(el("p.missing", {}, "This browser offers no WebGL 2, which " +
        "draws the bodies. Turn on hardware acceleration or take another browser."));
      return;
    }
    const { bodies } = this.data;
    const program = gl.createProgram();
    gl.attachShader(program, shader(gl, gl.VERTEX_SHADER, VERTEX));
    gl.attachShader(program, shader(gl, gl.FRAGMENT_SHADER, FRAGMENT));
    gl.linkProgram(program);
    gl.useProgram(program);
    this.at = Object.fromEntries(["turn", "centre", "zoom", "solid", "cover", "range", "plain"]
      .map((name) => [name, gl.getUniformLocation(program, name)]));
    this.#texture = "";
    this.#buffers = [["place", 3], ["value", 1]].map(([name, size]) => {
      const buffer = gl.createBuffer(), at = gl.getAttribLocation(program, name);
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.enableVertexAttribArray(at);
      gl.vertexAttribPointer(at, size, gl.FLOAT, false, 0, 0);
      return buffer;
    });
    [this.#faces, this.#edges] = [bodies.triangles, bodies.edges].map(({ values }) => {
      const buffer = gl.createBuffer();
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, Uint32Array.from(values), gl.STATIC_DRAW);
      return { buffer, size: values.length };
    });
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
  }

  // Browsers have few contexts and wait long before they take them back.
  close() {
    this.closed = true;
    this.gl?.getExtension("WEBGL_lose_context")?.loseContext();
  }

  #steer() {
    const held = new Map(), area = this.#above;
    const at = (event) => [event.offsetX, event.offsetY];
    const spread = () => {
      const [a, b] = held.values();
      return hypot(a[0] - b[0], a[1] - b[1]);
    };
    area.onpointerdown = (event) => {
      area.setPointerCapture(event.pointerId);
      held.set(event.pointerId, at(event));
    };
    area.onpointerup = area.onpointercancel = (event) => held.delete(event.pointerId);
    area.onpointermove = (event) => {
      const last = held.get(event.pointerId);
      if (!last) return;
      const now = at(event), dx = now[0] - last[0], dy = now[1] - last[1];
      const apart = held.size === 2 && spread();
      held.set(event.pointerId, now);
      if (apart) this.#zoom(spread() / apart, now);
      else if (this.d === 3 && !event.shiftKey) { this.rotate(0.01 * dx, 0.01 * dy); this.draw(); }
      else this.#shift(dx, dy);
    };
    area.onwheel = (event) => {
      event.preventDefault();
      this.#zoom(Math.exp(-0.0015 * event.deltaY), at(event));
    };
    area.ondblclick = () => { this.#fit(); this.draw(); };
  }

  #zoom(factor, [x, y]) {
    const dx = x - 0.5 * this.#width, dy = y - 0.5 * this.#height;
    this.#shift(-dx, -dy);
    this.size *= factor;
    this.#shift(dx, dy);
  }

  // Moves the picture by pixels; the centre of the view lies in the axes of the bodies.
  #shift(dx, dy) {
    const t = this.turn;
    for (let k = 0; k < 3; k++) this.#centre[k] -= (dx * t[3 * k] - dy * t[3 * k + 1]) / this.size;
    this.draw();
  }

  // By angles about the vertical and the horizontal of the screen; `turn` goes column by column, as
  // WebGL wants it.
  rotate(right, down) {
    const about = (angle, i, j) => {
      const [c, s] = [Math.cos(angle), Math.sin(angle)], t = this.turn;
      for (let k = 0; k < 3; k++) {
        const a = t[3 * k + i], b = t[3 * k + j];
        t[3 * k + i] = c * a - s * b;
        t[3 * k + j] = s * a + c * b;
      }
    };
    about(right, 2, 0);
    about(down, 1, 2);
  }

  look(name) {
    const [round, up] = VIEWS[name].map((angle) => angle * Math.PI / 180);
    this.turn = [1, 0, 0, 0, 0, -1, 0, 1, 0];
    this.rotate(round, 0);
    this.rotate(0, up);
    if (this.#width) this.#fit();
  }

  resize() {
    const [left, right, low, high] = this.#spread(), { ground } = this.data;
    this.#width = this.node.clientWidth || 300;
    const shape = (high - low) / (right - left) + (ground ? 0.12 : 0.04);
    this.#height = round(clamp(this.#width * shape, max(240, 0.34 * this.#width),
      max(300, min(0.6 * this.#width, 0.62 * innerHeight))));
    this.node.style.height = `${this.#height}px`;
    this.#under = layer(this.#below, this.#width, this.#height);
    this.#over = layer(this.#above, this.#width, this.#height);
    this.#canvas.width = this.#above.width;
    this.#canvas.height = this.#above.height;
    this.#fit();
    this.draw();
  }

  // What the box of the motion takes to the right and upwards as it is turned, about its middle.
  #spread() {
    const { box } = this.data, t = this.turn;
    return [0, 0, 1, 1].map((_, k) => {
      let half = 0;
      for (let i = 0; i < this.d; i++) half += abs(t[3 * i + (k >> 1)]) * (box[2 * i + 1] - box[2 * i]) / 2;
      return k % 2 ? half : -half;
    });
  }

  #fit() {
    const { box, ground } = this.data, [left, right, low, high] = this.#spread();
    this.size = min(0.9 * this.#width / (right - left), min(0.74 * this.#height, this.#height - 84) / (high - low));
    this.#centre = [0, 1, 2].map((i) => i < this.d ? 0.5 * (box[2 * i] + box[2 * i + 1]) : 0);
    if (ground && this.d < 3) this.#centre[1] -= 0.04 * this.#height / this.size;
  }

  project(x, y, z = 0) {
    const t = this.turn, p = [x - this.#centre[0], y - this.#centre[1], z - this.#centre[2]];
    return [0.5 * this.#width + this.size * (t[0] * p[0] + t[3] * p[1] + t[6] * p[2]),
      0.5 * this.#height - this.size * (t[1] * p[0] + t[4] * p[1] + t[7] * p[2])];
  }

  // Between stored instants numbers are interpolated, so that slow motion is smooth.
  #now({ values, columns }, out) {
    const { index, times, time } = this.clock;
    const next = min(index + 1, times.length - 1);
    const part = next > index ? clamp((time - times[index]) / (times[next] - times[index]), 0, 1) : 0;
    for (let k = 0; k < columns; k++) {
      out[k] = (1 - part) * values[index * columns + k] + part * values[next * columns + k];
    }
    return out;
  }

  #evaluate() {
    const { bodies, ground } = this.data, { d, count, q, modal } = this;
    let scale = this.scale, drift = [0, 0];
    if (this.mode >= 0) {
      q.fill(0);
      q[this.mode] = Math.sin(this.phase);
      scale = this.#shake();
    } else {
      this.#now(this.data.coordinates, q);
      // In space along x, then along y.
      if (ground?.wavy) ground.drift.forEach((row, k) => { drift[k < modal.length ? 0 : 1] += (1 - scale) * row * modal[k % modal.length]; });
    }
    times(bodies.shapes, count * d, modal, this.moved);
    const { places, moved } = this, points = bodies.points.values;
    for (let p = 0; p < count; p++) {
      for (let k = 0; k < d; k++) places[3 * p + k] = points[p * d + k] + scale * moved[p * d + k];
      places[3 * p] += drift[0];
      places[3 * p + 1] += drift[1];
    }
    this.#drawn = { scale, drift };
    this.#colour();
  }

  // Factor of a mode alone: its largest displacement is a part of the view.
  #shake() {
    const { values } = this.data.bodies.shapes, m = this.modal.length, { mode } = this;
    this.#reaches ??= [];
    let largest = this.#reaches[mode] ?? 0;
    for (let at = mode; !(mode in this.#reaches) && at < values.length; at += m) largest = max(largest, abs(values[at]));
    this.#reaches[mode] = largest;
    return 0.06 * min(this.#width, 2 * this.#height) / this.size / (largest || 1) * this.swing;
  }

  #colour() {
    const { bodies } = this.data, { d, count, values, moved, stress, paint } = this;
    const kinds = bodies.components.length, alone = this.mode >= 0;
    if (paint.includes("stress")) times(bodies.stress, count * kinds, this.q, stress);
    const part = bodies.components.indexOf(paint.slice(7)), mises = paint === "von Mises stress";
    const { contact } = this.data, { index } = this.clock, ends = bodies.ends?.[paint];
    const order = ["xx", "yy", "zz", "xy", "yz", "zx"].map((name) => bodies.components.indexOf(name));
    for (let p = 0; p < count; p++) {
      if (ends) {
        const node = bodies.owners.values[p], { state, forces } = contact;
        values[p] = node < 0 ? 0 : ends[0] ? state.values[node * state.rows + index]
          : forces.values[(node * d + d - 1) * forces.rows + index] / contact.areas[node];
      } else if (mises) values[p] = vonMises(stress, p * kinds, order);
      else if (part >= 0) values[p] = stress[p * kinds + part];
      else values[p] = hypot(moved[p * d], moved[p * d + 1], d > 2 ? moved[p * d + 2] : 0);
    }
    const swing = abs(Math.sin(this.phase)) || 1;
    let end = paint === "displacement" ? bodies.largest.displacement : bodies.largest.stress;
    if (alone) end = values.reduce((sum, value) => max(sum, abs(value)), 0) / swing;
    this.#limits = ends ?? [part >= 0 ? -end : 0, end || 1];
  }

  draw() {
    if (!this.#width) return;
    const begin = performance.now();
    this.#evaluate();
    this.#drawGround();
    if (this.gl) this.#drawBodies(this.gl);
    this.#drawOver();
    this.cost = performance.now() - begin;
  }

  #drawBodies(gl) {
    const { at, data, d, through, paint } = this, { box } = data;
    gl.viewport(0, 0, this.#canvas.width, this.#canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.depthMask(true);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const set = (buffer, values) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ARRAY_BUFFER, values, gl.DYNAMIC_DRAW);
    };
    set(this.#buffers[0], this.places);
    set(this.#buffers[1], this.values);
    const deep = 0.8 / hypot(...box.map((_, k) => k % 2 ? box[k] - box[k - 1] : 0));
    for (const what of d < 3 ? [] : [gl.DEPTH_TEST, gl.POLYGON_OFFSET_FILL]) gl.enable(what);
    through ? gl.enable(gl.BLEND) : gl.disable(gl.BLEND);
    // Edges lie before the faces that they bound.
    gl.polygonOffset(1, 1);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(!through);
    gl.uniformMatrix3fv(at.turn, false, this.turn);
    gl.uniform3fv(at.centre, this.#centre);
    gl.uniform3f(at.zoom, 2 * this.size / this.#width, 2 * this.size / this.#height, -deep);
    gl.uniform1f(at.solid, d - 2);
    gl.uniform1f(at.cover, through ? 0.3 : 1);
    gl.uniform2fv(at.range, this.#limits);
    if (this.#texture !== paint) {
      const map = this.#shades().flatMap((one) => [...one, 255]);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 64, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, Uint8Array.from(map));
      this.#texture = paint;
    }
    const { buffer, size } = this.#faces, { bodies } = data;
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffer);
    // Of contact, faces alone are coloured.
    const first = bodies.ends?.[paint] ? bodies.own : paint === "none" ? size : 0;
    gl.uniform4f(at.plain, 0.55, 0.62, 0.68, 1);
    gl.drawElements(gl.TRIANGLES, first, gl.UNSIGNED_INT, 0);
    gl.uniform4f(at.plain, 0, 0, 0, 0);
    gl.drawElements(gl.TRIANGLES, size - first, gl.UNSIGNED_INT, 4 * first);
    gl.uniform4f(at.plain, ...css("outline").split(",").map(Number), 1);
    gl.uniform1f(at.solid, 0);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.#edges.buffer);
    gl.drawElements(gl.LINES, this.#edges.size, gl.UNSIGNED_INT, 0);
  }

  #shades() {
    const { maps } = this.data;
    return maps[this.paint] ?? maps.component;
  }

  // Height of the ground and way that it has gone at the drawn instant.
  groundNow() {
    const { ground } = this.data, { scale } = this.#drawn, [a, b] = ground.direction;
    const way = this.#now(ground.travel, []).map((one) => (ground.wavy ? 1 : scale) * one);
    const level = ground.level - scale * ground.gap, profile = ground.profile.values;
    return { way, height: (x, y = 0) => {
      if (!ground.wavy) return level;
      x -= way[0];
      y -= way[1] || 0;
      if (ground.heights) return level + scale * this.#mapped(x, y);
      const at = clamp((a * x + b * y - ground.first) / ground.spacing, 0, profile.length - 1);
      const k = min(floor(at), profile.length - 2);
      return level + scale * (profile[k] + (at - k) * (profile[k + 1] - profile[k]));
    } };
  }

  // Height of a map that repeats itself, between its four points around a place of its own frame.
  #mapped(...place) {
    const { heights: { rows, columns, values }, origin, steps } = this.data.ground;
    const [[i, k, u], [j, l, v]] = [rows, columns].map((n, way) => {
      const at = (place[way] - origin[way]) / steps[way], first = floor(at), one = (first % n + n) % n;
      return [one, (one + 1) % n, at - first];
    });
    const row = (one) => (1 - v) * values[one * columns + j] + v * values[one * columns + l];
    return (1 - u) * row(i) + u * row(k);
  }

  #drawGround() {
    const c = this.#under, { box, ground } = this.data, [left, right] = box;
    c.clearRect(0, 0, this.#width, this.#height);
    if (!ground || this.mode >= 0) return;
    const { way, height } = this.groundNow(), [[first], [second]] = ticks(left, right, 12), spacing = second - first;
    c.strokeStyle = css("mark");
    c.fillStyle = css("ground");
    c.lineWidth = 1;
    if (this.d === 3) return this.#drawPlane(c, height, way, spacing);
    const world = (px) => (px - 0.5 * this.#width) / this.size + this.#centre[0];
    c.beginPath();
    for (let px = 0; px <= this.#width; px += 2) c.lineTo(px, this.project(0, height(world(px)))[1]);
    c.strokeStyle = css("soft");
    c.lineWidth = 1.5;
    c.stroke();
    c.lineTo(this.#width, 1e4);
    c.lineTo(0, 1e4);
    c.fill();
    c.strokeStyle = css("mark");
    c.beginPath();
    // Marks move with the ground.
    for (let k = Math.ceil((world(0) - way[0]) / spacing), x; (x = k * spacing + way[0]) < world(this.#width); k++) {
      const [px, py] = this.project(x, height(x));
      c.moveTo(px, py + 5);
      c.lineTo(px - 6, py + 15);
    }
    c.stroke();
  }

  // In space a sheet below the bodies: they lie before it as seen from above, and from below it is
  // seen through.
  #drawPlane(c, height, [wayX, wayY, angle], spacing) {
    const [left, right, front, back] = this.data.box, room = 0.2 * max(right - left, back - front);
    const wide = right - left + 2 * room, deep = back - front + 2 * room, [cx, cy] = this.data.ground.centre;
    const at = (x, y) => this.project(x, y, height(x, y));
    c.save();
    c.beginPath();
    for (let k = 0; k < 4; k += 1 / 64) {
      c.lineTo(...at(left - room + wide * clamp(min(k, 3 - k), 0, 1), front - room + deep * clamp(min(k - 1, 4 - k), 0, 1)));
    }
    c.fill();
    c.clip();
    c.beginPath();
    // A net that moves and turns with the ground, around what of it lies below the middle.
    const turned = (x, y, sine, cosine = Math.cos(angle)) => [cosine * x - sine * y, sine * x + cosine * y];
    const sine = Math.sin(angle), x0 = cx + wayX, y0 = cy + wayY, reach = round(hypot(wide, deep) / 2 / spacing + 1) * spacing;
    const [x1, y1] = turned((left + right) / 2 - x0, (front + back) / 2 - y0, -sine).map((one) => round(one / spacing) * spacing);
    for (let x = x1 - reach; x < x1 + reach; x += spacing) {
      for (let y = y1 - reach; y < y1 + reach; y += spacing) {
        // Along two sides of a mesh, which waves bend.
        for (let k = -6; k < 7; k++) {
          const [p, q] = turned(x + max(k, 0) * spacing / 6, y + max(-k, 0) * spacing / 6, sine);
          c[k > -6 ? "lineTo" : "moveTo"](...at(x0 + p, y0 + q));
        }
      }
    }
    c.stroke();
    c.restore();
  }

  #drawOver() {
    const c = this.#over, { contact, bodies } = this.data;
    c.clearRect(0, 0, this.#width, this.#height);
    if (contact && this.data.whole && this.mode < 0) this.#drawContact(c, contact);
    c.font = `600 12px ${css("font")}`;
    c.textAlign = "center";
    c.lineWidth = 3;
    c.strokeStyle = css("panel");
    c.fillStyle = css("ink");
    for (const { name, label } of bodies.parts) {
      const at = this.project(...this.places.subarray(3 * label, 3 * label + 3));
      c.strokeText(name, ...at);
      c.fillText(name, ...at);
    }
    this.#tell();
  }

  #drawContact(c, contact) {
    const { d, turn } = this, { scale, drift } = this.#drawn, { index } = this.clock, { state, forces, feet } = contact;
    const n = state.columns, size = contact.places.rows, axes = contact.axes.values;
    const moved = times(contact.rows, size * d, this.modal, this.#feet ??= new Float64Array(size * d));
    const node = (k) => k < n ? k : feet[k - n], faint = [], shown = [];
    for (let k = 0; k < size; k++) {
      const p = [0, 0, 0];
      for (let i = 0; i < d; i++) p[i] = contact.places.values[k * d + i] + scale * moved[k * d + i];
      p[0] += drift[0];
      p[1] += drift[1];
      shown.push(this.project(...p));
      // Seen through the body: a normal points into it.
      let towards = 0;
      for (let i = 0; i < d; i++) towards += turn[3 * i + 2] * axes[node(k) * d * d + (d - 1) * d + i];
      faint.push(!this.through && (k < n ? towards : -towards) > 1e-6);
    }
    const reach = 0.2 * min(this.#height, this.#width) / (contact.largest || 1);
    const apart = n > 1 ? hypot(shown[1][0] - shown[0][0], shown[1][1] - shown[0][1]) : 12;
    const radius = clamp(0.3 * apart, 1.5, 3.6);
    for (const hidden of [true, false]) {
      c.globalAlpha = hidden ? 0.35 : 1;
      c.strokeStyle = c.fillStyle = css("accent");
      c.lineWidth = size > 100 ? 1.1 : 1.6;
      const lines = new Path2D(), heads = new Path2D(), dots = contact.colours.map(() => new Path2D());
      for (let k = 0; k < size; k++) {
        if (faint[k] !== hidden) continue;
        const at = node(k), push = k < n ? reach : -reach;
        let right = 0, up = 0;
        for (let j = 0; this.arrows && j < d; j++) {
          const force = forces.values[(at * d + j) * forces.rows + index] * push;
          for (let i = 0; i < d; i++) {
            right += turn[3 * i] * axes[(at * d + j) * d + i] * force;
            up += turn[3 * i + 1] * axes[(at * d + j) * d + i] * force;
          }
        }
        this.#arrow(lines, heads, shown[k], right, -up);
        const [x, y] = shown[k], r = radius * (k < n ? 1 : 0.65), dot = dots[state.values[at * state.rows + index]];
        dot.moveTo(x + r, y);
        dot.arc(x, y, r, 0, 7);
      }
      c.stroke(lines);
      c.fill(heads);
      c.lineWidth = 1;
      c.strokeStyle = css("ink");
      dots.forEach((dot, k) => {
        c.fillStyle = contact.colours[k] || css("panel");
        c.fill(dot);
        c.stroke(dot);
      });
    }
    c.globalAlpha = 1;
  }

  // A force that pushes ends at its point, so that it does not lie on the body.
  #arrow(lines, heads, [x, y], dx, dy) {
    const length = hypot(dx, dy);
    if (length < 1.5) return;
    const [ux, uy] = [dx / length, dy / length], head = min(7, 0.5 * length);
    lines.moveTo(x - dx, y - dy);
    lines.lineTo(x - head * ux, y - head * uy);
    heads.moveTo(x, y);
    heads.lineTo(x - head * (ux - 0.4 * uy), y - head * (uy + 0.4 * ux));
    heads.lineTo(x - head * (ux + 0.4 * uy), y - head * (uy - 0.4 * ux));
    heads.closePath();
  }

  // An arrow where values lie beyond the colours.
  #tell() {
    const alone = this.mode >= 0, { paint } = this, what = paint === "displacement" ? "m" : "Pa";
    const [low, high] = this.#limits, { peak, beyond } = this.data.bodies.largest;
    const more = paint.includes("stress") && !alone && high < peak;
    this.bar.hide(["none", "contact state"].includes(paint));
    this.bar.show(this.#shades(), alone ? low < 0 ? "−largest" : "0" : quantity(low, what),
      alone ? "largest" : `${more ? "▶ " : ""}${quantity(high, what)}${more ? `; ${beyond}` : ""}`);
  }
}
