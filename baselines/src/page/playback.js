// Plays recorded episodes: every figure of class "playback" holds its episode as JSON. It has
// pictures, or WebGL 2 draws it from boxes, balls, cylinders and meshes. Lengths are then in meters
// unless stated otherwise, z is up, and quaternions are w x y z.
"use strict";
(() => {
  const VERTEX = `#version 300 es
    in vec3 position, normal;
    uniform mat4 camera;
    uniform mat3 rotation;
    uniform vec3 scale, translation;
    out vec3 place, direction;
    void main() {
      place = rotation * (scale * position) + translation;
      direction = rotation * (normal / scale);
      gl_Position = camera * vec4(place, 1.0);
    }`;
  const FRAGMENT = `#version 300 es
    precision highp float;
    in vec3 place, direction;
    uniform vec3 eye;
    uniform vec4 rgba;
    out vec4 color;
    void main() {
      vec3 n = normalize(direction), toEye = normalize(eye - place);
      if (dot(n, toEye) < 0.0) n = -n;
      vec3 sun = normalize(vec3(0.25, -0.35, 1.0));
      float light = 0.34 + 0.42 * max(dot(n, sun), 0.0) + 0.26 * max(dot(n, toEye), 0.0);
      float gloss = 0.12 * pow(max(dot(n, normalize(sun + toEye)), 0.0), 24.0);
      color = vec4(min(rgba.rgb * light + gloss, 1.0) * rgba.a, rgba.a);
    }`;

  // ------------------------------------------------------------------ unit shapes, as triangles

  const surface = (columns, rows, point) => {
    const numbers = [];
    for (let i = 0; i < columns; i++) {
      for (let j = 0; j < rows; j++) {
        const corner = (a, b) => point((i + a) / columns, (j + b) / rows);
        numbers.push(...corner(0, 0), ...corner(1, 0), ...corner(1, 1));
        numbers.push(...corner(0, 0), ...corner(1, 1), ...corner(0, 1));
      }
    }
    return numbers;
  };
  const round = (u) => [Math.cos(2 * Math.PI * u), Math.sin(2 * Math.PI * u)];
  const ball = surface(36, 18, (u, v) => {
    const [x, y] = round(u), r = Math.sin(Math.PI * v), z = -Math.cos(Math.PI * v);
    return [r * x, r * y, z, r * x, r * y, z];
  });
  const lid = (z) => surface(40, 1, (u, v) => [...round(u).map((c) => v * c), z, 0, 0, z]);
  const tube = surface(40, 1, (u, v) => [...round(u), 2 * v - 1, ...round(u), 0]);
  const square = surface(1, 1, (u, v) => [2 * u - 1, 2 * v - 1, 0, 0, 0, 1]);
  const side = (axis, sign) => surface(1, 1, (u, v) => {
    const turn = (w) => [w[(3 - axis) % 3], w[(4 - axis) % 3], w[(5 - axis) % 3]];
    return [...turn([sign, 2 * u - 1, 2 * v - 1]), ...turn([sign, 0, 0])];
  });
  const cube = [0, 1, 2].flatMap((axis) => [...side(axis, 1), ...side(axis, -1)]);
  const MESHES = { ball, tube: [...tube, ...lid(1), ...lid(-1)], square, cube };

  // A mesh of the episode, in tenths of a millimeter. Edges between triangles that are nearly in one
  // plane are smooth and the others sharp, much as MuJoCo draws them.
  const smoothed = ({ corners, triangles }) => {
    const normals = triangles.map((triangle) => {
      const [a, b, c] = triangle.map((corner) => corners[corner]);
      const [ab, ac] = [b, c].map((end) => end.map((p, i) => p - a[i]));
      return cross(ab, ac);
    });
    const near = (n, m) => dot(n, m) > 0.8 * Math.hypot(...n) * Math.hypot(...m);
    const around = corners.map(() => []);
    triangles.forEach((triangle, i) => triangle.forEach((corner) => around[corner].push(i)));
    return triangles.flatMap((triangle, i) => triangle.flatMap((corner) => {
      const met = around[corner].map((j) => normals[j]).filter((n) => near(n, normals[i]));
      return [...corners[corner], ...[0, 1, 2].map((k) => met.reduce((sum, n) => sum + n[k], 0))];
    }));
  };

  // The parts of a shape: the mesh of each, its scale, and its shift along the z axis of the shape.
  const parts = ({ shape, size: [a, b, c], mesh }) => {
    switch (shape) {
      case "plane": return [["square", [a, b, 1], 0]];
      case "sphere": return [["ball", [a, a, a], 0]];
      case "ellipsoid": return [["ball", [a, b, c], 0]];
      case "cylinder": return [["tube", [a, a, b], 0]];
      case "capsule":
        return [["tube", [a, a, b], 0], ["ball", [a, a, a], b], ["ball", [a, a, a], -b]];
      case "mesh": return [[mesh, [1e-4, 1e-4, 1e-4], 0]];
      default: return [["cube", [a, b, c], 0]];
    }
  };

  // --------------------------------------------------------------------------------- geometry

  const multiply = ([a, b, c, d], [e, f, g, h]) => [
    a * e - b * f - c * g - d * h, a * f + b * e + c * h - d * g,
    a * g - b * h + c * e + d * f, a * h + b * g - c * f + d * e,
  ];
  // In column-major order, as WebGL requires.
  const matrix = ([w, x, y, z]) => [
    1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y),
    2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x),
    2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y),
  ];
  const transform = (m, [x, y, z], [px, py, pz]) => [0, 1, 2].map((i) =>
    m[i] * x + m[3 + i] * y + m[6 + i] * z + [px, py, pz][i]);
  const cross = ([a, b, c], [d, e, f]) => [b * f - c * e, c * d - a * f, a * e - b * d];
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

  const NEAR = 0.05, FAR = 20, FIELD_OF_VIEW = Math.PI / 4;

  // A camera that looks at a point from a distance; angles in radians as in MuJoCo.
  const look = ({ azimuth, elevation, distance, at }, aspect) => {
    const [ca, sa] = [Math.cos(azimuth), Math.sin(azimuth)];
    const [ce, se] = [Math.cos(elevation), Math.sin(elevation)];
    const forward = [ce * ca, ce * sa, se], right = [sa, -ca, 0], up = cross(right, forward);
    const eye = at.map((p, i) => p - distance * forward[i]);
    // The view is at least as wide as it is high, so that a narrow picture shows the whole robot.
    const f = Math.min(1, aspect) / Math.tan(FIELD_OF_VIEW / 2);
    const rows = [
      [...right.map((v) => v * f / aspect), -dot(right, eye) * f / aspect],
      [...up.map((v) => v * f), -dot(up, eye) * f],
    ];
    const k = (FAR + NEAR) / (FAR - NEAR), depth = -dot(forward, eye);
    rows.push([...forward.map((v) => v * k), depth * k - 2 * FAR * NEAR / (FAR - NEAR)]);
    rows.push([...forward, depth]);
    return { eye, camera: [0, 1, 2, 3].flatMap((column) => rows.map((row) => row[column])) };
  };

  // ---------------------------------------------------------------------------------- drawing

  const program = (gl) => {
    const linked = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(linked, shader);
    }
    gl.linkProgram(linked);
    if (!gl.getProgramParameter(linked, gl.LINK_STATUS)) {
      throw new Error(gl.getProgramInfoLog(linked) || "the shaders cannot be linked");
    }
    return linked;
  };

  // Returns a function that draws the episode at a frame, as a camera sees it.
  const painter = (gl, canvas, episode) => {
    const shader = program(gl);
    gl.useProgram(shader);
    gl.enable(gl.DEPTH_TEST);
    const uniform = (name) => gl.getUniformLocation(shader, name);
    const at = {};
    for (const name of ["camera", "rotation", "scale", "translation", "eye", "rgba"]) {
      at[name] = uniform(name);
    }
    const meshes = {};
    for (const [name, numbers] of Object.entries({ ...MESHES, ...episode.meshes.map(smoothed) })) {
      const array = gl.createVertexArray();
      gl.bindVertexArray(array);
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(numbers), gl.STATIC_DRAW);
      ["position", "normal"].forEach((attribute, i) => {
        const location = gl.getAttribLocation(shader, attribute);
        gl.enableVertexAttribArray(location);
        gl.vertexAttribPointer(location, 3, gl.FLOAT, false, 24, 12 * i);
      });
      meshes[name] = { array, count: numbers.length / 6 };
    }
    const pose = (body, frame) => {
      const poses = episode.bodies[body];
      const first = 7 * frame < poses.length ? 7 * frame : 0; // a body at rest has one pose
      return [poses.slice(first, first + 3), poses.slice(first + 3, first + 7)];
    };
    const draw = (shape, position, quaternion) => {
      const rotation = matrix(quaternion);
      gl.uniformMatrix3fv(at.rotation, false, rotation);
      gl.uniform4fv(at.rgba, shape.rgba);
      for (const [name, scale, shift] of parts(shape)) {
        gl.uniform3fv(at.scale, scale);
        gl.uniform3fv(at.translation, transform(rotation, [0, 0, shift], position));
        gl.bindVertexArray(meshes[name].array);
        gl.drawArrays(gl.TRIANGLES, 0, meshes[name].count);
      }
    };
    const goal = { shape: "sphere", size: [0.02, 0, 0], rgba: [1, 0, 0, 1] };

    return (frame, orbit) => {
      gl.viewport(0, 0, canvas.width, canvas.height);
      gl.clearColor(0, 0, 0, 0);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      const { eye, camera } = look(orbit, canvas.width / canvas.height);
      gl.uniformMatrix4fv(at.camera, false, camera);
      gl.uniform3fv(at.eye, eye);
      for (const shape of episode.shapes) {
        const [position, quaternion] = pose(shape.body, frame);
        draw(
          shape,
          transform(matrix(quaternion), shape.position, position),
          multiply(quaternion, shape.quaternion),
        );
      }
      for (const position of episode.goals) draw(goal, position, [1, 0, 0, 0]);
    };
  };

  // --------------------------------------------------------------------------------- controls

  // Orbits by mouse, touch (two fingers zoom) and keys; calls `moved` after every change.
  const orbitBy = (canvas, orbit, moved) => {
    const turn = (x, y) => {
      orbit.azimuth -= x;
      orbit.elevation = Math.min(0.3, Math.max(-1.55, orbit.elevation - y));
      moved();
    };
    const zoom = (factor) => {
      orbit.distance = Math.min(8, Math.max(0.3, orbit.distance * factor));
      moved();
    };
    const fingers = new Map();
    const spread = () => {
      const [a, b] = [...fingers.values()];
      return Math.hypot(a.x - b.x, a.y - b.y);
    };
    canvas.addEventListener("pointerdown", (event) => {
      fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
      if (event.isTrusted) canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      const last = fingers.get(event.pointerId);
      if (!last) return;
      const before = fingers.size === 2 ? spread() : 0;
      const [x, y] = [event.clientX - last.x, event.clientY - last.y];
      fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
      if (fingers.size === 1) turn(0.008 * x, 0.008 * y);
      else if (fingers.size === 2 && spread() > 0) zoom(before / spread());
    });
    for (const end of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(end, (event) => fingers.delete(event.pointerId));
    }
    // A wheel without Ctrl still scrolls the page.
    canvas.addEventListener("wheel", (event) => {
      if (!event.ctrlKey) return;
      event.preventDefault();
      zoom(Math.exp(0.005 * event.deltaY));
    }, { passive: false });
    const keys = {
      ArrowLeft: () => turn(-0.1, 0), ArrowRight: () => turn(0.1, 0),
      ArrowUp: () => turn(0, -0.1), ArrowDown: () => turn(0, 0.1),
      "+": () => zoom(0.9), "-": () => zoom(1.1),
    };
    canvas.addEventListener("keydown", (event) => {
      if (!keys[event.key]) return;
      event.preventDefault();
      keys[event.key]();
    });
  };

  // Returns a function that shows a frame of an episode in a canvas which the reader can turn; null
  // without WebGL 2.
  const scene = (canvas, episode) => {
    const gl = canvas.getContext("webgl2", { antialias: true });
    if (!gl) return null;
    const paint = painter(gl, canvas, episode);
    const orbit = { azimuth: 132 * Math.PI / 180, elevation: -14 * Math.PI / 180, ...episode.view };
    let shown = 0;
    const redraw = () => paint(shown, orbit);
    orbitBy(canvas, orbit, redraw);
    const fit = () => {
      const pixels = Math.min(window.devicePixelRatio || 1, 2);
      canvas.width = Math.max(1, Math.round(canvas.clientWidth * pixels));
      canvas.height = Math.max(1, Math.round(canvas.clientHeight * pixels));
      redraw();
    };
    new ResizeObserver(fit).observe(canvas);
    fit();
    return (frame) => {
      shown = frame;
      redraw();
    };
  };

  // Returns a function that shows the picture of a frame.
  const pictures = (image, episode) => (frame) => {
    image.src = episode.pictures[frame];
  };

  const start = (figure) => {
    const find = (selector) => figure.querySelector(selector);
    const [button, slider, told] =
      ["button", "input", "output"].map((selector) => find(selector));
    const episode = JSON.parse(find("script").textContent);
    // A hidden canvas has no size.
    figure.classList.add("ready");
    const draw = episode.pictures ? pictures(find("img"), episode) : scene(find("canvas"), episode);
    if (!draw) {
      figure.classList.remove("ready");
      find(".missing").textContent = "This browser has no WebGL 2, which the playback needs.";
      return;
    }
    const seen = find(".seen");
    const last = episode.successes.length - 1;
    let frame = 0, playing = false;

    // A number that is not finite is null.
    const decimals = (number) => (number === null ? "–" : number.toFixed(3).replace("-", "−"));
    const show = (number) => {
      frame = Math.min(last, Math.max(0, number));
      slider.value = frame;
      const reward = decimals(frame ? episode.rewards[frame - 1] : null).replace(/\.000$/, "");
      const distance = episode.distances[frame];
      const parts = [`step ${frame} of ${last}`, `reward ${reward}`];
      if (distance !== null) parts.push(`distance ${decimals(distance)}${episode.unit}`);
      if (episode.successes[frame]) parts.push("reached");
      told.textContent = parts.join(" · ");
      draw(frame);
      // The policy does not act on the last frame.
      if (seen) seen.src = episode.seen[Math.min(frame, episode.seen.length - 1)];
    };
    const pause = () => {
      playing = false;
      button.textContent = "Play";
    };
    const play = () => {
      playing = true;
      button.textContent = "Pause";
      const first = frame < last ? frame : 0;
      let began;
      const tick = (now) => {
        if (!playing) return;
        began ??= now;
        show(first + Math.floor((now - began) / 1000 / episode.period));
        if (frame < last) requestAnimationFrame(tick);
        else pause();
      };
      requestAnimationFrame(tick);
    };
    // `#frame=N` in the address shows a step, for links and screenshots.
    const goToFragment = () => {
      const number = /^#frame=(\d+)$/.exec(location.hash);
      if (number) {
        pause();
        show(Number(number[1]));
      }
    };

    button.addEventListener("click", () => (playing ? pause() : play()));
    slider.addEventListener("input", () => {
      pause();
      show(Number(slider.value));
    });
    window.addEventListener("hashchange", goToFragment);
    show(0);
    goToFragment();
  };

  document.querySelectorAll("figure.playback").forEach(start);
})();
