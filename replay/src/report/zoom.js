"use strict";
(() => {
  const NS = "http://www.w3.org/2000/svg", figures = [];
  const element = (parent, name, attributes) => {
    const made = document.createElementNS(NS, name);
    for (const key of Object.keys(attributes)) made.setAttribute(key, attributes[key]);
    return parent.appendChild(made);
  };
  for (const figure of document.querySelectorAll("figure[data-x]")) {
    const svg = figure.querySelector("svg"), numbers = (name) => figure.dataset[name].split(" ").map(Number);
    const [left, top, right, bottom] = numbers("px"), id = "clip" + figures.length;
    const clip = element(element(svg, "clipPath", { id }), "rect", { x: left, y: top, width: right - left, height: bottom - top });
    for (const text of svg.querySelectorAll("text")) if (Number(text.getAttribute("y")) > bottom) text.classList.add("tick");
    const lines = [...svg.querySelectorAll("polyline.l, polyline.thin, rect.hot, rect.cool")]
      .filter((line) => !(line.points && line.points.length && line.points[0].y > bottom)); // samples of the legend
    for (const line of lines) { line.setAttribute("clip-path", `url(#${id})`); line.setAttribute("vector-effect", "non-scaling-stroke"); }
    const pointer = element(svg, "line", { class: "pointer", y1: top, y2: bottom, visibility: "hidden" });
    const chosen = element(svg, "rect", { class: "chosen", y: top, height: bottom - top, width: 0 });
    const words = element(svg, "text", { class: "at", y: top - 4, x: left });
    figures.push({ svg, lines, clip, pointer, chosen, words, left, right, top, bottom, x: numbers("x"), y: numbers("y"), seen: null });
  }
  const all = (f) => f.seen || f.x;
  const toPx = (f, t) => f.left + (t - all(f)[0]) / (all(f)[1] - all(f)[0]) * (f.right - f.left);
  const toTime = (f, px) => all(f)[0] + (px - f.left) / (f.right - f.left) * (all(f)[1] - all(f)[0]);
  const place = (f, event) => {
    const box = f.svg.getBoundingClientRect();
    return Math.min(f.right, Math.max(f.left, (event.clientX - box.left) * f.svg.viewBox.baseVal.width / box.width));
  };
  const values = (f, t) => {
    const px = f.left + (t - f.x[0]) / (f.x[1] - f.x[0]) * (f.right - f.left), found = [];
    for (const line of f.lines) {
      const points = line.points; if (!points || line.classList.contains("thin")) continue;
      for (let k = 1; k < points.length; k++) if (points[k - 1].x <= px && px <= points[k].x) {
        const py = points[k].y; found.push((f.y[0] + (f.bottom - py) / (f.bottom - f.top) * (f.y[1] - f.y[0])).toPrecision(4)); break;
      }
    }
    return found.slice(0, 4).join(" ");
  };
  const point = (t) => figures.forEach((f) => {
    const px = toPx(f, t), inside = px >= f.left && px <= f.right;
    f.pointer.setAttribute("visibility", inside ? "visible" : "hidden");
    f.pointer.setAttribute("x1", px); f.pointer.setAttribute("x2", px);
    f.words.textContent = inside ? `${t.toFixed(2)} s: ${values(f, t)}` : "";
  });
  const zoom = (span) => figures.forEach((f) => {
    f.seen = span && span[1] > f.x[0] && span[0] < f.x[1] ? span : null;
    const scale = (f.x[1] - f.x[0]) / (all(f)[1] - all(f)[0]);
    const shift = f.left - scale * (f.left + (all(f)[0] - f.x[0]) / (f.x[1] - f.x[0]) * (f.right - f.left));
    f.svg.classList.toggle("zoomed", f.seen !== null);
    for (const line of f.lines) line.setAttribute("transform", f.seen ? `matrix(${scale} 0 0 1 ${shift} 0)` : "");
    // The clip is in the line's own units, which the transform has stretched.
    f.clip.setAttribute("x", (f.left - (f.seen ? shift : 0)) / (f.seen ? scale : 1));
    f.clip.setAttribute("width", (f.right - f.left) / (f.seen ? scale : 1));
    (f.ends || []).forEach((end) => end.remove());
    f.ends = f.seen ? [[f.left, "start", 0], [f.right, "end", 1]].map(([x, anchor, k]) => {
      const end = element(f.svg, "text", { class: "at", x, y: f.bottom + 16, "text-anchor": anchor });
      end.textContent = f.seen[k].toFixed(2); return end;
    }) : [];
  });
  figures.forEach((f) => {
    let from = null;
    f.svg.addEventListener("pointerdown", (event) => { from = place(f, event); event.preventDefault(); });
    f.svg.addEventListener("pointermove", (event) => {
      const px = place(f, event); point(toTime(f, px));
      if (from !== null) { f.chosen.setAttribute("x", Math.min(from, px)); f.chosen.setAttribute("width", Math.abs(px - from)); }
    });
    f.svg.addEventListener("pointerup", (event) => {
      const px = place(f, event); f.chosen.setAttribute("width", 0);
      if (from !== null && Math.abs(px - from) > 8) zoom([toTime(f, Math.min(from, px)), toTime(f, Math.max(from, px))]);
      from = null;
    });
    f.svg.addEventListener("dblclick", () => zoom(null));
  });
})();
