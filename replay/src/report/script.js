"use strict";
(() => {
  const NS = "http://www.w3.org/2000/svg", data = JSON.parse(document.getElementById("flight").textContent), rows = data.rows;
  const made = (parent, name, attributes) => {
    const element = document.createElementNS(NS, name);
    for (const key of Object.keys(attributes)) element.setAttribute(key, attributes[key]);
    return parent.appendChild(element);
  };
  // The place of a time in a sorted list: between which two, and how far.
  const between = (length, of, time) => {
    let low = 0, high = length - 1;
    if (high < 1 || !(of(0) <= time && time <= of(high))) return null;
    while (high - low > 1) { const middle = (low + high) >> 1; if (of(middle) <= time) low = middle; else high = middle; }
    return [low, (time - of(low)) / (of(high) - of(low) || 1)];
  };
  const numbers = (text) => (text.match(/-?[\d.]+/g) || []).map(Number);

  // The pictures, and the lines in them.
  const figures = [...document.querySelectorAll("figure[data-axes]:not([data-axes=''])")].map((figure) => {
    const plot = figure.querySelector(".plot"), box = numbers(plot.getAttribute("viewBox")), over = figure.dataset.axes === "time";
    const lines = [...plot.querySelectorAll(".l")].map((path) => path.getAttribute("d").split("M").slice(1).map((piece) => {
      const d = numbers(piece);
      return d.filter((_, k) => k % 2).map((y, k) => [d[2 * k], y]);
    }));
    return { figure, plot, lines, over, wide: box[2], high: box[3], x: numbers(figure.dataset.x), y: numbers(figure.dataset.y), seen: null,
      shows: over ? null : numbers(figure.dataset.axes), values: figure.querySelectorAll("figcaption i"),
      moved: [...figure.querySelectorAll("[data-t]")],
      now: over ? made(plot, "path", { class: "now" }) : made(plot, "circle", { class: "now", r: 45 }) };
  });
  document.documentElement.classList.add("live");

  const short = (value) => Math.abs(value) >= 100 ? value.toFixed(0) : Math.abs(value) >= 10 ? value.toFixed(1) : value.toFixed(2);
  const show = (f, time) => {
    if (!f.over) {
      const at = state(time);
      if (!at) return;
      const [x, y] = f.shows.map((k) => at[1 + k]);
      f.now.setAttribute("cx", (x - f.x[0]) / (f.x[1] - f.x[0]) * f.wide);
      f.now.setAttribute("cy", (f.y[1] - y) / (f.y[1] - f.y[0]) * f.high);
      return;
    }
    const px = (time - f.x[0]) / (f.x[1] - f.x[0]) * f.wide;
    f.now.setAttribute("d", px >= 0 && px <= f.wide ? `M${px} 0v${f.high}` : "");
    f.lines.forEach((pieces, k) => {
      let value = "";
      for (const points of pieces) {
        const at = between(points.length, (i) => points[i][0], px);
        if (!at) continue;
        const [i, share] = at, y = points[i][1] + share * (points[i + 1][1] - points[i][1]);
        value = short(f.y[1] - y / f.high * (f.y[1] - f.y[0]));
      }
      f.values[k].textContent = value;
    });
  };
  // A row between two.
  const state = (time) => {
    const at = between(rows.length, (k) => rows[k][0], time);
    return at && rows[at[0]].map((value, k) => value + at[1] * (rows[at[0] + 1][k] - value));
  };

  // One time for all.
  const first = rows.length ? rows[0][0] : 0, last = rows.length ? rows[rows.length - 1][0] : 1;
  let now = 0, playing = 0;
  const bar = document.createElement("div");
  bar.className = "time";
  bar.innerHTML = `<button type="button">play</button><input type="range" step="0.01" min="${first}" max="${last}" aria-label="time"/><output></output><small>Drag in a picture, or arrow keys. Zoom: shift and drag, + and \u2212, 0 for all. Click a name to hide its line.</small>`;
  const [button, range, output] = bar.children;
  const to = (time) => {
    now = Math.min(last, Math.max(first, time));
    range.value = now;
    figures.forEach((f) => show(f, now));
    const at = state(now), phase = data.phases.find(([, from, until]) => from <= now && now < until);
    output.textContent = `T+${now.toFixed(2)} s` + (phase ? ` ${phase[0]}` : "") + (at ? `, ${short(at[3])} m` : "");
    draw(at);
  };
  // The address names the time, so that it can be sent to somebody: `report.html#t=14.70`.
  const remember = () => { try { history.replaceState(null, "", `#t=${now.toFixed(2)}`); } catch { /* a page in a frame has no address */ } };
  const named = () => { const found = /^#t=(-?\d+\.?\d*)$/.exec(location.hash); return found && Number(found[1]); };
  const stop = () => { cancelAnimationFrame(playing); playing = 0; button.textContent = "play"; };
  const play = () => {
    if (playing) { stop(); remember(); return; }
    let before = performance.now();
    if (now >= last - 0.01) to(first);
    button.textContent = "pause";
    const step = (time) => { to(now + (time - before) / 1e3); before = time; if (now < last) playing = requestAnimationFrame(step); else stop(); };
    playing = requestAnimationFrame(step);
  };
  button.addEventListener("click", play);
  range.addEventListener("input", () => { stop(); to(Number(range.value)); });
  range.addEventListener("change", remember);
  addEventListener("hashchange", () => { if (named() !== null) { stop(); to(named()); } });

  // A part of the time in all pictures over time.
  let seen = null;
  const zoom = (span) => { seen = span; figures.filter((f) => f.over).forEach((f) => {
    f.seen = span && span[1] > f.x[0] && span[0] < f.x[1] ? span : null;
    const [from, until] = f.seen || f.x, unit = f.wide / (f.x[1] - f.x[0]);
    f.plot.setAttribute("viewBox", `${(from - f.x[0]) * unit} 0 ${(until - from) * unit} ${f.high}`);
    f.figure.classList.toggle("zoomed", f.seen !== null);
    for (const element of f.moved) {
      const px = (Number(element.dataset.t) - from) / (until - from) * f.wide / 10;
      element.setAttribute(element.tagName === "circle" ? "cx" : "x", px);
      element.style.display = px < 0 || px > f.wide / 10 ? "none" : "";
    }
    (f.ends || []).forEach((end) => end.remove());
    f.ends = f.seen ? [[0, "", from], [f.wide / 20, "middle", (from + until) / 2]].map(([x, anchor, time]) => {
      const end = made(f.plot.parentNode, "text", { class: anchor, x, y: f.high / 10 + 14 });
      end.textContent = time.toFixed(2); return end;
    }) : [];
  }); };
  figures.filter((f) => f.over).forEach((f) => {
    const target = made(f.plot.parentNode, "rect", { class: "target", width: f.wide / 10, height: f.high / 10 });
    const time = (event) => {
      const box = target.getBoundingClientRect(), [from, until] = f.seen || f.x;
      return from + Math.min(1, Math.max(0, (event.clientX - box.left) / box.width)) * (until - from);
    };
    let from = null, chosen = null;
    target.addEventListener("pointerdown", (event) => {
      stop(); target.setPointerCapture(event.pointerId);
      if (event.shiftKey) { from = time(event); chosen = made(f.plot, "rect", { class: "chosen", height: f.high, width: 0 }); }
      to(time(event)); event.preventDefault();
    });
    target.addEventListener("pointermove", (event) => {
      if (event.pointerType !== "mouse" && !event.buttons) return;
      if (playing) return;
      to(time(event));
      if (chosen) {
        const unit = f.wide / (f.x[1] - f.x[0]), [a, b] = [from, time(event)].sort((a, b) => a - b);
        chosen.setAttribute("x", (a - f.x[0]) * unit); chosen.setAttribute("width", (b - a) * unit);
      }
    });
    target.addEventListener("pointerup", (event) => {
      remember();
      if (!chosen) return;
      chosen.remove(); chosen = null;
      const span = [from, time(event)].sort((a, b) => a - b);
      if (span[1] - span[0] > 0.05) zoom(span);
    });
    target.addEventListener("dblclick", () => zoom(null));
  });

  // A name in a legend hides its line, and shows it again.
  figures.forEach((f) => f.figure.querySelectorAll("figcaption span").forEach((name, k) => {
    const line = f.plot.querySelectorAll(".l")[k];
    if (!line) return;
    name.tabIndex = 0; name.setAttribute("role", "switch"); name.setAttribute("aria-checked", "true");
    const toggle = () => {
      const hidden = name.classList.toggle("hidden");
      line.style.display = hidden ? "none" : ""; name.setAttribute("aria-checked", String(!hidden));
    };
    name.addEventListener("click", toggle);
    name.addEventListener("keydown", (event) => { if (event.key === "Enter") toggle(); });
  }));

  // Time and zoom from the keyboard. The keys that scroll a page are left to the page.
  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || rows.length < 2) return;
    const step_s = event.shiftKey ? 1 : 0.05;
    const closer = (factor) => {
      const half = factor * ((seen ? seen[1] - seen[0] : last - first) / 2);
      zoom(2 * half >= last - first ? null : [now - Math.max(half, 0.05), now + Math.max(half, 0.05)]);
    };
    const keys = {
      ArrowLeft: () => to(now - step_s), ArrowRight: () => to(now + step_s), p: play,
      "+": () => closer(0.5), "=": () => closer(0.5), "-": () => closer(2), 0: () => zoom(null) };
    if (!Object.hasOwn(keys, event.key)) return;
    if (event.key !== "p") stop();
    keys[event.key](); remember(); event.preventDefault();
  });

  // The vehicle, seen from a side that a hand may turn: from the south at first.
  const maps = document.querySelector(".maps"), shape = data.shape, SIZE = 240;
  let side = 0, draw = () => {};
  const figure = document.createElement("figure");
  if (maps && shape && rows.some((row) => row[4] !== null)) {
    figure.className = "vehicle";
    figure.innerHTML = `<figcaption><b>Vehicle at this time</b> <span></span></figcaption><svg viewBox="0 0 ${SIZE} ${SIZE}"></svg>`;
    maps.append(figure);
    const svg = figure.querySelector("svg"), words = figure.querySelector("span");
    const [[trunk, fin, gimbal, legs], middle_m, booster_m, most_n] = shape, long = trunk.length_m, r = trunk.diameter_m / 2;
    // Open fin i stands so far from the y axis, in the quarter that its number says.
    const stands = (fin.from_y_deg - fin.hinge_off_deg) * Math.PI / 180;
    const outward = [[-1, 1], [-1, -1], [1, -1], [1, 1]].map(([b, c]) => [b * Math.cos(stands), c * Math.sin(stands)]);
    const hull = (points) => {
      const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
      const half = (list) => list.reduce((kept, p) => {
        while (kept.length > 1) {
          const [a, b] = kept.slice(-2);
          if ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) > 0) break;
          kept.pop();
        }
        kept.push(p); return kept;
      }, []).slice(0, -1);
      return half(sorted).concat(half(sorted.reverse()));
    };
    const ring = (x, radius) => Array.from({ length: 20 }, (_, k) => [x, radius * Math.cos(k * Math.PI / 10), radius * Math.sin(k * Math.PI / 10)]);
    draw = (at) => {
      svg.replaceChildren();
      if (!at) return;
      const [, , , height, w, x, y, z, pitch, yaw] = at, fins = at.slice(10, 14), [thrust, booster, chute] = at.slice(14);
      const size = Math.hypot(w, x, y, z), [qw, qx, qy, qz] = [w, x, y, z].map((value) => value / size);
      const world = ([a, b, c]) => [
        (1 - 2 * (qy * qy + qz * qz)) * a + 2 * (qx * qy - qw * qz) * b + 2 * (qx * qz + qw * qy) * c,
        -(2 * (qx * qy + qw * qz) * a + (1 - 2 * (qx * qx + qz * qz)) * b + 2 * (qy * qz - qw * qx) * c), // east is against y
        2 * (qx * qz - qw * qy) * a + 2 * (qy * qz + qw * qx) * b + (1 - 2 * (qx * qx + qy * qy)) * c];
      const [sin, cos] = [Math.sin(side), Math.cos(side)], DOWN = 0.2; // the eye looks down a little
      const tail = booster > 0.5 && booster_m ? -booster_m : 0, center = (long + tail) / 2;
      const on = thrust > 0.5, scale = 150 / (1.2 * long - tail);
      const seen = ([north, east, up]) => {
        const right = east * cos + north * sin, away = north * cos - east * sin;
        return [SIZE / 2 + scale * right, SIZE / 2 - scale * (up * Math.cos(DOWN) + away * Math.sin(DOWN)), away];
      };
      // Stations along the axis count from the nozzle; the middle of the stack stands still.
      const body = ([station, b, c]) => seen(world([station - center, b, c]));
      const items = [], add = (name, points, closed = true) => items.push([points.reduce((sum, p) => sum + p[2], 0) / points.length, name, points, closed]);
      const solid = (name, ...rings) => add(name, hull(rings.flat().map(body)));
      const bell = (along, radius) => { // a ring about the axis of the motor, which turns about its pivot
        const [p, q] = [pitch, yaw].map((deg) => deg * Math.PI / 180);
        return ring(0, radius).map(([, b, c]) => [gimbal.pivot_station_m - along, b - along * Math.sin(q), c + along * Math.sin(p)]);
      };
      if (tail) { solid("metal", ring(tail, r), ring(0, r)); if (on) solid("fire", ring(tail, 0.6 * r), ring(tail - 0.6 * long, 0)); }
      else {
        solid("metal", bell(0, 0.5 * r), bell(gimbal.pivot_station_m + r, 0.7 * r));
        if (on) solid("fire", bell(gimbal.pivot_station_m + r, 0.6 * r), bell(gimbal.pivot_station_m + r + 0.7 * long * thrust / most_n, 0));
        for (const [b, c] of [[1, 0], [0, 1], [-1, 0], [0, -1]]) {
          const [foot, out] = [legs.foot_station_m, legs.foot_radius_m], hip = 0.3 * long;
          add("leg", [[hip, b * r, c * r], [foot, b * out, c * out], [0.02, b * r, c * r]].map(body), false);
        }
      }
      solid("skin", ring(0, r), ring(0.78 * long, r));
      solid("band", ring(0.55 * long, r), ring(0.6 * long, r));
      solid("band", ring(0.78 * long, r), ring(0.9 * long, 0.7 * r), ring(long, 0));
      outward.forEach(([b, c], k) => {
        const [hinge, length] = [fin.station_m, fin.length_m], open = fins[k] * Math.PI / 180, half = 0.5 * r;
        const out = r + length * Math.sin(open), back = hinge - length * Math.cos(open);
        add("metal", [[hinge, r, half], [back, out, half], [back, out, -half], [hinge, r, -half]].map(([s, o, side]) => body([s, o * b - side * c, o * c + side * b])));
      });
      if (chute > 0.05) {
        const top = body([long, 0, 0]), span = 40 * Math.sqrt(chute), rise = 30; // the nose is 57 or more below the edge
        for (const share of [-1, 0, 1]) made(svg, "path", { class: "leg", d: `M${top[0]} ${top[1]}L${top[0] + share * span} ${top[1] - rise}` });
        made(svg, "path", { class: "band", d: `M${top[0] - span} ${top[1] - rise}a${span} ${span * 0.6} 0 0 1 ${2 * span} 0z` });
      }
      // The ground, if it is near: where the feet of the upright vehicle would stand on it.
      const under = middle_m - legs.foot_station_m + height, middle = world([middle_m - center, 0, 0]);
      const floor = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11].map((k) => seen([long * Math.cos(k * Math.PI / 6), long * Math.sin(k * Math.PI / 6), middle[2] - under]));
      const path = (name, points, closed) => made(svg, "path", { class: name, d: "M" + points.map((p) => `${p[0].toFixed(1)} ${p[1].toFixed(1)}`).join("L") + (closed ? "Z" : "") });
      if (floor[0][1] < SIZE + 30) path("floor", floor, true);
      // The far ones first; the body's bands lie on its skin.
      const rank = { skin: 0, band: 0.001 };
      items.sort((a, b) => (b[0] - a[0]) - ((rank[b[1]] || 0) - (rank[a[1]] || 0)));
      items.forEach(([, name, points, closed]) => path(name, points, closed));
      const tilt = Math.acos(Math.max(-1, Math.min(1, world([1, 0, 0])[2]))) * 180 / Math.PI;
      const eye = ["south", "south-east", "east", "north-east", "north", "north-west", "west", "south-west"][((Math.round(side * 4 / Math.PI) % 8) + 8) % 8];
      words.textContent = `from the ${eye}; tilt ${tilt.toFixed(0)}\u00b0, gimbal ${pitch.toFixed(1)}\u00b0 ${yaw.toFixed(1)}\u00b0, thrust ${thrust.toFixed(0)} N`;
    };
    // At first from where its leaning in the burn is seen best.
    const [nn, ne, ee] = rows.filter((row) => data.at !== null && Math.abs(row[0] - data.at) < 3).reduce(([nn, ne, ee], [, , , , w, x, y, z]) => {
      const [n, e] = [1 - 2 * (y * y + z * z), -2 * (x * y + w * z)];
      return [nn + n * n, ne + n * e, ee + e * e];
    }, [0, 0, 0]);
    side = 0.5 * Math.atan2(2 * ne, ee - nn);
    let grip = null;
    svg.addEventListener("pointerdown", (event) => { grip = [event.clientX, side]; svg.setPointerCapture(event.pointerId); });
    svg.addEventListener("pointermove", (event) => { if (grip) { side = grip[1] + (event.clientX - grip[0]) / 60; to(now); } });
    svg.addEventListener("pointerup", () => { grip = null; });
    // Out of sight it comes along in a corner.
    new IntersectionObserver(([seen]) => figure.classList.toggle("away", !seen.isIntersecting && seen.boundingClientRect.top < 0)).observe(maps);
  }
  if (rows.length > 1) {
    document.querySelector("main").append(bar);
    const sign = document.querySelector("circle.sign");
    to(named() ?? data.at ?? (sign ? Number(sign.dataset.t) : (first + last) / 2));
  }
})();
