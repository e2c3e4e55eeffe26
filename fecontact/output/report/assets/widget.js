// The page of a run as a widget: anywidget calls this where it is shown, and what it returns at its end.

export default {
  async render({ model, el: place }) {
    const { buffer, byteOffset, byteLength } = model.get("block");
    const shadow = place.attachShadow({ mode: "open" }), sheet = new CSSStyleSheet();
    sheet.replaceSync(model.get("styles"));
    shadow.adoptedStyleSheets = [sheet];
    const host = el("div.page");
    shadow.append(host);
    place.tabIndex = 0;
    let clock, waits = 0;
    // The kernel hears of the time a few times in a second, however fast it runs.
    const tell = () => { waits = 0; model.set("time", clock.time); model.save_changes(); };
    const close = await show(host, new Uint8Array(buffer, byteOffset, byteLength), place, (one) => {
      clock = one;
      clock.watchers.push(() => { waits ||= setTimeout(tell, 150); });
    });
    const hear = () => { if (!waits && clock?.time !== model.get("time")) clock.set(model.get("time")); };
    model.on("change:time", hear);
    return () => {
      model.off("change:time", hear);
      clearTimeout(waits);
      close();
    };
  },
};
