// Each kind of page has its own `build`.

build(document.body).catch((error) => {
  document.body.append(el("p.missing", {}, typeof DecompressionStream === "undefined"
    ? "This browser is too old for this report; take one of 2023 or later."
    : `This report cannot be read: ${error.message}`));
});
