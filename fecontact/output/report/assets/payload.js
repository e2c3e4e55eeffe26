// The data of the page: a header whose arrays are whole numbers times a step.

async function readBlock(text) {
  const packed = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  const content = new Uint8Array(await new Response(stream).arrayBuffer());
  const start = 4 + new DataView(content.buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(content.subarray(4, start)));
  const fill = (item) => {
    if (item === null || typeof item !== "object") return item;
    if ("planes" in item) return readArray(item, content.subarray(start));
    for (const key of Object.keys(item)) item[key] = fill(item[key]);
    return item;
  };
  return fill(header);
}

// Values row by row; steps belong to columns, differences run down the rows of each.
function readArray({ at, planes, shape, step }, bytes) {
  const rows = shape[0];
  const columns = shape.slice(1).reduce((a, b) => a * b, 1);
  const size = rows * columns;
  const values = columns > 1 ? new Float32Array(size) : new Float64Array(size);
  for (let column = 0, k = at; column < columns; column++) {
    const unit = step[step.length > 1 ? column : 0];
    for (let row = 0, sum = 0; row < rows; row++, k++) {
      let zigzag = 0;
      for (let plane = planes; plane--;) zigzag = 256 * zigzag + bytes[k + plane * size];
      sum += zigzag % 2 ? -(zigzag + 1) / 2 : zigzag / 2;
      values[row * columns + column] = sum * unit;
    }
  }
  return { values, rows, columns };
}
