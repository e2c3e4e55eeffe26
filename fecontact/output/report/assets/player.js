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
uniform sampler2D map; uniform vec2 range; uniform vec4 plain; uniform float solid;
void main() {
  float at = clamp((shade - range.x) / (range.y - range.x), 0.0, 1.0);
  colour = plain.a > 0.0 ? plain : vec4(texture(map, vec2(at, 0.5)).rgb, 1.0);
  if (solid > 0.0) {
    vec3 normal = normalize(cross(dFdx(seen), dFdy(seen)));
    colour.rgb *= 0.55 + 0.45 * abs(normal.z);
  }
}`;

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
  constructor(data, clock) {
    Object.assign(this, { data, clock, mode: -1, paint: data.bodies.paints[0], arrows: true, swing: 1 });
    const { bodies } = data;
    this.d = bodies.dimension;
    this.count = bodies.points.rows;
    this.scale = data.scale;
    this.q = new Float64Array(bodies.modes.length);
    this.moved = new Float32Array(this.count * this.d);
    this.stress = new Float32Array(this.count * bodies.components.length);
    this.places = new Float32Array(3 * this.count);
    this.values = new Float32Array(this.count);
    this.turn = [1, 0, 0, 0, 1, 0, 0, 0, 1];
    [this.below, this.canvas, this.above] = [el("canvas"), el("canvas"), el("canvas")];
    this.node = el("div.stage", {}, this.below, this.canvas, this.above);
    this.node.player = this;
    this.begin();
    this.steer();
  }

  begin() {
    const gl = this.gl = this.canvas.getContext("webgl2", { antialias: true });
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
    this.at = (name) => gl.getUniformLocation(program, name);
    this.buffers = [["place", 3], ["value", 1]].map(([name, size]) => {
      const buffer = gl.createBuffer(), at = gl.getAttribLocation(program, name);
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.enableVertexAttribArray(at);
      gl.vertexAttribPointer(at, size, gl.FLOAT, false, 0, 0);
      return buffer;
    });
    [this.faces, this.edges] = [bodies.triangles, bodies.edges].map(({ values }) => {
      const buffer = gl.createBuffer();
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, Uint32Array.from(values), gl.STATIC_DRAW);
      return { buffer, size: values.length };
    });
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
  }

  close() { this.gl?.getExtension("WEBGL_lose_context")?.loseContext(); }

  steer() {
    const held = new Map(), area = this.above;
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
      if (apart) this.zoom(spread() / apart, now);
      else if (this.d === 3 && !event.shiftKey) this.rotate(dx, dy);
      else this.shift(dx, dy);
    };
    area.onwheel = (event) => {
      event.preventDefault();
      this.zoom(Math.exp(-0.0015 * event.deltaY), at(event));
    };
    area.ondblclick = () => { this.fit(); this.draw(); };
  }

  zoom(factor, [x, y]) {
    const dx = x - 0.5 * this.width, dy = y - 0.5 * this.height;
    this.shift(-dx, -dy);
    this.size *= factor;
    this.shift(dx, dy);
  }

  // Moves the picture by pixels; the centre of the view lies in the axes of the bodies.
  shift(dx, dy) {
    const t = this.turn;
    for (let k = 0; k < 3; k++) this.centre[k] -= (dx * t[3 * k] - dy * t[3 * k + 1]) / this.size;
    this.draw();
  }

  // By pixels about the axes of the screen; `turn` goes column by column, as WebGL wants it.
  rotate(dx, dy) {
    const about = (angle, i, j) => {
      const [c, s] = [Math.cos(angle), Math.sin(angle)], t = this.turn;
      for (let k = 0; k < 3; k++) {
        const a = t[3 * k + i], b = t[3 * k + j];
        t[3 * k + i] = c * a - s * b;
        t[3 * k + j] = s * a + c * b;
      }
    };
    about(0.01 * dx, 2, 0);
    about(0.01 * dy, 1, 2);
    this.draw();
  }

  resize() {
    const [left, right, low, high] = this.data.box;
    this.width = this.node.clientWidth || 300;
    const shape = (high - low) / (right - left) + (this.data.ground ? 0.12 : 0.04);
    this.height = round(clamp(this.width * shape, max(240, 0.34 * this.width),
      max(300, min(0.6 * this.width, 0.62 * innerHeight))));
    this.node.style.height = `${this.height}px`;
    this.ground = layer(this.below, this.width, this.height);
    this.over = layer(this.above, this.width, this.height);
    this.canvas.width = this.above.width;
    this.canvas.height = this.above.height;
    this.fit();
    this.draw();
  }

  fit() {
    const [left, right, low, high] = this.data.box;
    this.size = min(0.9 * this.width / (right - left), 0.74 * this.height / (high - low));
    this.centre = [0.5 * (left + right), 0.5 * (low + high), 0];
    if (this.data.ground) this.centre[1] -= 0.04 * this.height / this.size;
  }

  project(x, y, z = 0) {
    const t = this.turn, p = [x - this.centre[0], y - this.centre[1], z - this.centre[2]];
    return [0.5 * this.width + this.size * (t[0] * p[0] + t[3] * p[1] + t[6] * p[2]),
      0.5 * this.height - this.size * (t[1] * p[0] + t[4] * p[1] + t[7] * p[2])];
  }

  // Between stored instants coordinates are interpolated, so that slow motion is smooth.
  coordinates() {
    const { values, columns } = this.data.coordinates, { index, times, time } = this.clock;
    const next = min(index + 1, times.length - 1);
    const part = next > index ? clamp((time - times[index]) / (times[next] - times[index]), 0, 1) : 0;
    for (let k = 0; k < columns; k++) {
      this.q[k] = (1 - part) * values[index * columns + k] + part * values[next * columns + k];
    }
  }

  evaluate() {
    const { bodies, ground } = this.data, { d, count, q } = this;
    let scale = this.scale, drift = 0;
    if (this.mode >= 0) {
      q.fill(0);
      q[this.mode] = Math.sin(this.phase);
      scale = this.shake();
    } else {
      this.coordinates();
      if (ground?.wavy) drift = (1 - scale) * ground.drift.reduce((sum, row, k) => sum + row * q[k], 0);
    }
    times(bodies.shapes, count * d, q, this.moved);
    const { places, moved } = this, points = bodies.points.values;
    for (let p = 0; p < count; p++) {
      for (let k = 0; k < d; k++) places[3 * p + k] = points[p * d + k] + scale * moved[p * d + k];
      places[3 * p] += drift;
    }
    this.drawn = { scale, drift };
    this.colour();
  }

  // Factor of a mode alone: its largest displacement is a part of the view.
  shake() {
    const { values, columns } = this.data.bodies.shapes, m = this.q.length;
    let largest = 0;
    for (let at = this.mode; at < values.length; at += m) largest = max(largest, abs(values[at]));
    return 0.06 * min(this.width, 2 * this.height) / this.size / (largest || 1) * this.swing;
  }

  colour() {
    const { bodies } = this.data, { d, count, values, moved, stress, paint } = this;
    const kinds = bodies.components.length, alone = this.mode >= 0;
    if (paint.includes("stress")) times(bodies.stress, count * kinds, this.q, stress);
    const part = bodies.components.indexOf(paint.slice(7));
    const order = ["xx", "yy", "zz", "xy", "yz", "zx"].map((name) => bodies.components.indexOf(name));
    for (let p = 0; p < count; p++) {
      if (paint === "displacement") {
        let sum = 0;
        for (let k = 0; k < d; k++) sum += moved[p * d + k] ** 2;
        values[p] = Math.sqrt(sum);
      } else if (paint === "von Mises stress") values[p] = vonMises(stress, p * kinds, order);
      else if (part >= 0) values[p] = stress[p * kinds + part];
    }
    const swing = abs(Math.sin(this.phase)) || 1;
    let end = paint === "displacement" ? bodies.largest.displacement : bodies.largest.stress;
    if (alone) end = values.reduce((sum, value) => max(sum, abs(value)), 0) / swing;
    this.limits = [part >= 0 ? -end : 0, end || 1];
  }

  draw() {
    if (!this.width) return;
    const begin = performance.now();
    this.evaluate();
    this.drawGround();
    if (this.gl) this.drawBodies(this.gl);
    this.drawOver();
    this.cost = performance.now() - begin;
  }

  drawBodies(gl) {
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const set = (buffer, values) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ARRAY_BUFFER, values, gl.DYNAMIC_DRAW);
    };
    set(this.buffers[0], this.places);
    set(this.buffers[1], this.values);
    const solid = this.d === 3, deep = 0.2 * this.size / max(this.width, this.height);
    solid ? gl.enable(gl.DEPTH_TEST) : gl.disable(gl.DEPTH_TEST);
    gl.uniformMatrix3fv(this.at("turn"), false, this.turn);
    gl.uniform3fv(this.at("centre"), this.centre);
    gl.uniform3f(this.at("zoom"), 2 * this.size / this.width, 2 * this.size / this.height, -deep);
    gl.uniform1f(this.at("solid"), solid ? 1 : 0);
    gl.uniform2fv(this.at("range"), this.limits);
    if (this.texture !== this.paint) {
      const map = this.shades().flatMap((one) => [...one, 255]);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 64, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, Uint8Array.from(map));
      this.texture = this.paint;
    }
    gl.uniform4f(this.at("plain"), 0.55, 0.62, 0.68, this.paint === "none" ? 1 : 0);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.faces.buffer);
    gl.drawElements(gl.TRIANGLES, this.faces.size, gl.UNSIGNED_INT, 0);
    gl.uniform4f(this.at("plain"), ...css("--outline").split(",").map(Number), 1);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.edges.buffer);
    gl.drawElements(gl.LINES, this.edges.size, gl.UNSIGNED_INT, 0);
  }

  shades() {
    const { maps } = this.data;
    return maps[this.paint === "displacement" ? "displacement"
      : this.paint === "von Mises stress" ? "von_mises" : "component"];
  }

  drawGround() {
    const c = this.ground, { ground } = this.data;
    c.clearRect(0, 0, this.width, this.height);
    if (!ground || this.mode >= 0 || this.d === 3) return;
    const { scale } = this.drawn, travel = ground.travel.values[this.clock.index];
    const way = (ground.wavy ? 1 : scale) * travel, level = ground.level - scale * ground.gap;
    const profile = ground.profile.values, world = (px) => (px - 0.5 * this.width) / this.size + this.centre[0];
    const height = (x) => {
      const at = clamp((x - way - ground.first) / ground.spacing, 0, profile.length - 1);
      const k = min(floor(at), profile.length - 2);
      return level + scale * (ground.wavy ? profile[k] + (at - k) * (profile[k + 1] - profile[k]) : 0);
    };
    c.beginPath();
    for (let px = 0; px <= this.width; px += 2) c.lineTo(px, this.project(0, height(world(px)))[1]);
    c.strokeStyle = css("--soft");
    c.lineWidth = 1.5;
    c.stroke();
    c.lineTo(this.width, this.height + 9);
    c.lineTo(0, this.height + 9);
    c.fillStyle = css("--ground");
    c.fill();
    // Marks move with the ground.
    const [left, right] = this.data.box, [[first], [second]] = ticks(left, right, 12);
    const spacing = second - first;
    c.strokeStyle = css("--mark");
    c.beginPath();
    for (let k = Math.ceil((world(0) - way) / spacing); k * spacing + way < world(this.width); k++) {
      const x = k * spacing + way, [px, py] = this.project(x, height(x));
      c.moveTo(px, py + 5);
      c.lineTo(px - 6, py + 15);
    }
    c.stroke();
  }

  drawOver() {
    const c = this.over, { contact, bodies } = this.data;
    c.clearRect(0, 0, this.width, this.height);
    if (contact && this.mode < 0) this.drawContact(c, contact);
    c.font = `600 12px ${css("--font")}`;
    c.textAlign = "center";
    c.lineWidth = 3;
    c.strokeStyle = css("--panel");
    c.fillStyle = css("--ink");
    for (const { name, label } of bodies.parts) {
      const at = this.project(...this.places.subarray(3 * label, 3 * label + 3));
      c.strokeText(name, ...at);
      c.fillText(name, ...at);
    }
    if (this.paint !== "none") this.bar(c);
  }

  drawContact(c, contact) {
    const { scale, drift } = this.drawn, d = this.d, n = contact.state.columns, at = this.clock.index * n;
    const size = contact.places.rows, moved = times(contact.rows, size * d, this.q, new Float64Array(size * d));
    const shown = Array.from({ length: size }, (_, k) => {
      const p = [0, 1, 2].map((i) => i < d ? contact.places.values[k * d + i] + scale * moved[k * d + i] : 0);
      p[0] += drift;
      return this.project(...p);
    });
    const reach = 0.2 * min(this.height, this.width) / (contact.largest || 1);
    c.strokeStyle = c.fillStyle = css("--accent");
    c.lineWidth = 1.6;
    for (let k = 0; this.arrows && k < size; k++) {
      const node = k < n ? k : contact.feet[k - n], sign = k < n ? reach : -reach;
      const F = contact.normal.values[at + node] * sign, R = contact.along.values[at + node] * sign;
      const [tip, foot] = [this.project(0, 0), this.project(...[0, 1, 2].map((i) =>
        ((contact.normals[node][i] || 0) * F + (contact.tangents[node][i] || 0) * R) / this.size))];
      this.arrow(c, shown[k], foot[0] - tip[0], foot[1] - tip[1]);
    }
    c.lineWidth = 1;
    const apart = n > 1 ? hypot(shown[1][0] - shown[0][0], shown[1][1] - shown[0][1]) : 12;
    const radius = clamp(0.3 * apart, 1.5, 3.6);
    for (let k = 0; k < size; k++) {
      const state = contact.state.values[at + (k < n ? k : contact.feet[k - n])];
      c.beginPath();
      c.arc(...shown[k], radius * (k < n ? 1 : 0.65), 0, 7);
      c.fillStyle = contact.colours[state] || css("--panel");
      c.strokeStyle = css("--ink");
      c.fill();
      c.stroke();
    }
  }

  // A force that pushes ends at its point, so that it does not lie on the body.
  arrow(c, [x, y], dx, dy) {
    const length = hypot(dx, dy);
    if (length < 1.5) return;
    const [ux, uy] = [dx / length, dy / length], head = min(7, 0.5 * length);
    c.beginPath();
    c.moveTo(x - dx, y - dy);
    c.lineTo(x - head * ux, y - head * uy);
    c.stroke();
    c.beginPath();
    c.moveTo(x, y);
    c.lineTo(x - head * (ux - 0.4 * uy), y - head * (uy + 0.4 * ux));
    c.lineTo(x - head * (ux + 0.4 * uy), y - head * (uy - 0.4 * ux));
    c.fill();
  }

  bar(c) {
    const width = min(180, 0.3 * this.width), left = this.width - width - 14, top = 12;
    this.shades().forEach((one, k) => {
      c.fillStyle = `rgb(${one})`;
      c.fillRect(left + width * k / 64, top, width / 64 + 0.6, 7);
    });
    c.font = `11px ${css("--font")}`;
    c.fillStyle = css("--soft");
    c.textBaseline = "top";
    const alone = this.mode >= 0, what = this.paint.includes("stress") ? "Pa" : "m";
    const [low, high] = this.limits, { peak } = this.data.bodies.largest;
    const beyond = what === "Pa" && !alone && high < peak;
    c.textAlign = "left";
    c.fillText(alone ? "" : quantity(low, what), left, top + 11);
    c.textAlign = "right";
    c.fillText(alone ? "largest" : quantity(high, what) + (beyond ? `, peak ${quantity(peak, what)}` : ""),
      left + width, top + 11);
    c.textBaseline = "alphabetic";
  }
}
