// The data of the page: a header whose arrays are whole numbers times a step.

// Two of 91 letters hold 13 bits.
function bytesOf(text) {
  const codes = new TextEncoder().encode(text), bytes = new Uint8Array(codes.length * 13 >> 4);
  const letter = (k) => (codes[k] === 33 ? 60 : codes[k]) - 35;
  for (let k = 0, at = 0, bits = 0, count = 0; k < codes.length; k += 2) {
    bits = bits << 13 | 91 * letter(k) + letter(k + 1);
    for (count += 13; count > 7;) bytes[at++] = bits >> (count -= 8);
    bits &= (1 << count) - 1;
  }
  return bytes;
}

async function inflate(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// The header with its arrays; those that the first picture does without are zero until `rest` is
// done, which lets the page draw in between.
async function readBlock(packed) {
  const size = (bytes, at) => new DataView(bytes.buffer, bytes.byteOffset).getUint32(at, true);
  const end = 8 + size(packed, 0), content = await inflate(packed.subarray(8, end)), start = 4 + size(content, 0);
  const late = [], fill = (item) => {
    if (item === null || typeof item !== "object") return item;
    if ("planes" in item) {
      const made = emptyArray(item);
      if (item.later) late.push([item, made]);
      else for (let column = 0; column < made.columns; column++) readColumn(item, column, content.subarray(start), made);
      return made;
    }
    for (const key of Object.keys(item)) item[key] = fill(item[key]);
    return item;
  };
  const header = fill(JSON.parse(new TextDecoder().decode(content.subarray(4, start))));
  header.rest = async () => {
    const content = await inflate(packed.subarray(end, end + size(packed, 4)));
    let begin = performance.now();
    for (const [item, made] of late) {
      for (let column = 0; column < made.columns; column++) {
        readColumn(item, column, content, made);
        if (performance.now() - begin < 12) continue;
        await new Promise((done) => setTimeout(done));
        begin = performance.now();
      }
    }
  };
  return header;
}

function emptyArray({ shape }) {
  const rows = shape[0], columns = shape.slice(1).reduce((a, b) => a * b, 1);
  return { rows, columns, values: new (columns > 1 ? Float32Array : Float64Array)(rows * columns) };
}

// Steps belong to columns, differences run down their rows. Values lie row by row, later ones column
// by column.
function readColumn({ at, planes, step, order, later, near }, column, bytes, { values, rows, columns }) {
  const size = rows * columns, unit = step[step.length > 1 ? column : 0], stride = later ? 1 : columns;
  let to = later ? column * rows : column;
  // Columns that differ little from an earlier one.
  const other = near && near[column] >= 0 ? near[column] * rows : -1;
  for (let row = 0, sum = 0, rate = 0, k = at + column * rows; row < rows; row++, k++, to += stride) {
    let zigzag = bytes[k];
    if (planes > 1) zigzag += 256 * bytes[k + size];
    for (let plane = 2, weight = 65536; plane < planes; plane++, weight *= 256) zigzag += weight * bytes[k + plane * size];
    const change = planes < 4 ? zigzag >> 1 ^ -(zigzag & 1) : zigzag % 2 ? -(zigzag + 1) / 2 : zigzag / 2;
    if (order) sum += rate += change; else sum += change;
    values[to] = (other < 0 ? sum : sum + round(values[other + row] / unit)) * unit;
  }
}
