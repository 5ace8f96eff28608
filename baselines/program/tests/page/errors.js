// Inserted before everything else: records errors.
window.faults = [];
window.addEventListener("error", (event) => window.faults.push(String(event.message)));
console.error = (...parts) => window.faults.push(parts.join(" "));
// Chromium's virtual time waits for timers, but not for animation frames.
window.requestAnimationFrame = (draw) => setTimeout(() => draw(performance.now()), 16);
