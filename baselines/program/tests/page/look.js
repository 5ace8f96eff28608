// Inserted after everything else: uses each playback as a visitor does, and looks at its pixels.
(async () => {
  const frames = (count) => new Promise((done) => {
    const next = () => (count-- > 0 ? requestAnimationFrame(next) : done());
    next();
  });
  const use = async (figure) => {
    const parts = ["canvas", "input", "button"];
  const [canvas, slider, button] = parts.map((part) => figure.querySelector(part));
    const gl = canvas.getContext("webgl2");
    // Must be called in the same task as a draw: afterwards the browser discards the picture.
    const pixels = () => {
      const bytes = new Uint8Array(4 * canvas.width * canvas.height);
      gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
      return new Uint32Array(bytes.buffer);
    };
    const scrub = (frame) => {
      slider.value = frame;
      slider.dispatchEvent(new Event("input"));
      return pixels();
    };
    const changed = (a, b) => a.reduce((count, pixel, i) => count + (pixel !== b[i]), 0);
    const count = (image, test) => image.reduce((sum, p) =>
      sum + test(p & 255, (p >> 8) & 255, (p >> 16) & 255, p >>> 24), 0);
    const drag = (pointerType) => {
      const at = (type, x, y) => canvas.dispatchEvent(
        new PointerEvent(type, { pointerId: 7, pointerType, clientX: x, clientY: y }));
      at("pointerdown", 100, 100);
      at("pointermove", 180, 110);
      const image = pixels();
      at("pointerup", 180, 110);
      return image;
    };
    await frames(2);
    const first = scrub(0), middle = scrub(Math.floor(slider.max / 2)), again = scrub(0);
    const result = {
      title: figure.querySelector("strong").textContent,
      size: first.length,
      colors: new Set(first).size,
      background: count(first, (r, g, b, a) => a === 0),
      blue: count(first, (r, g, b) => b > r + 60 && b > g + 20),
      red: count(first, (r, g, b) => r > 120 && g < 90 && b < 90),
      changed_by_scrubbing: changed(first, middle),
      changed_by_scrubbing_back: changed(first, again),
      changed_by_mouse: changed(first, drag("mouse")),
    };
    const turned = scrub(0);
    result.changed_by_touch = changed(turned, drag("touch"));
    button.click();
    await frames(30);
    button.click();
    result.played_to = Number(slider.value);
    result.seen_width = figure.querySelector(".seen")?.naturalWidth ?? 0;
    result.told = figure.querySelector("output").textContent;
    return result;
  };
  const playbacks = [];
  for (const figure of document.querySelectorAll("figure.playback")) {
    playbacks.push(await use(figure));
  }
  const seen = {
    faults: window.faults,
    playbacks,
    width: document.documentElement.clientWidth,
    content_width: document.documentElement.scrollWidth,
    dark: matchMedia("(prefers-color-scheme: dark)").matches,
    page: getComputedStyle(document.body).backgroundColor,
  };
  return seen;
})().catch((error) => ({ faults: [String(error)] })).then((seen) => {
  const told = document.createElement("pre");
  told.id = "seen";
  told.textContent = JSON.stringify(seen);
  parent.document.body.replaceChildren(told);
});
