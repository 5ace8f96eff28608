// Put before everything else: keeps what goes wrong.
window.faults = [];
window.addEventListener("error", (event) => window.faults.push(String(event.message)));
console.error = (...parts) => window.faults.push(parts.join(" "));
// Chromium's virtual time does not wait for pictures to be due, but for timers.
window.requestAnimationFrame = (draw) => setTimeout(() => draw(performance.now()), 16);
