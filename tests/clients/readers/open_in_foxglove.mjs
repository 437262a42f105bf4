// Opens a log in Foxglove's own application in a browser without a window:
// node open_in_foxglove.mjs BROWSER LOG HEIGHT GIMBAL PICTURE, where HEIGHT and GIMBAL are the message paths of its two plots.
// Prints JSON once the whole log is plotted: the text of the page, and how many pixels the line of each plot covers.
import { createServer } from "node:http";
import { createReadStream, existsSync, statSync } from "node:fs";
import { createRequire } from "node:module";
import path from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";

const [browserPath, log, height, gimbal, picture] = process.argv.slice(2);
const PATIENCE_MS = 120_000;
// Everything but the lines is grey.
const COLORFUL = 60;
const LINE_PIXELS_MIN = 300;

const require = createRequire(path.join(process.cwd(), "package.json"));
const { default: puppeteer } = await import(pathToFileURL(require.resolve("puppeteer-core")));
const modules = path.join(process.cwd(), "node_modules");
const studio = path.join(modules, "@foxglove/studio-base/assets");
const page = path.join(path.dirname(fileURLToPath(import.meta.url)), "foxglove/index.html");

const types = { ".js": "text/javascript", ".html": "text/html", ".wasm": "application/wasm" };
function fileOf(url) {
  if (url === "/") return page;
  if (url === "/flight.mcap") return log;
  const root = url.startsWith("/react") ? modules : studio;
  return path.join(root, url.replace("/assets/", "/"));
}
// Foxglove reads a log piece by piece, so the server must support ranges.
const server = createServer((request, response) => {
  const file = fileOf(new URL(request.url, "http://here").pathname);
  if (!existsSync(file) || !statSync(file).isFile()) return response.writeHead(404).end();
  const size = statSync(file).size;
  const type = types[path.extname(file)] ?? "application/octet-stream";
  const headers = { "content-type": type, "accept-ranges": "bytes" };
  const range = /^bytes=(\d+)-(\d*)$/.exec(request.headers.range ?? "");
  const start = range ? Number(range[1]) : 0;
  const end = range?.[2] ? Math.min(Number(range[2]), size - 1) : size - 1;
  headers["content-length"] = end - start + 1;
  if (range) headers["content-range"] = `bytes ${start}-${end}/${size}`;
  response.writeHead(range ? 206 : 200, headers);
  return request.method === "HEAD" ? response.end() : createReadStream(file, { start, end }).pipe(response);
});
await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
const origin = `http://127.0.0.1:${server.address().port}`;

const browser = await puppeteer.launch({
  executablePath: browserPath,
  headless: true,
  args: ["--no-sandbox", "--enable-unsafe-swiftshader", "--use-gl=angle", "--use-angle=swiftshader"],
});
try {
  const tab = await browser.newPage();
  // A busy machine takes longer than the usual 30 s.
  tab.setDefaultNavigationTimeout(180_000);
  await tab.setViewport({ width: 1600, height: 1000 });
  const crashes = [];
  tab.on("pageerror", (error) => crashes.push(String(error)));
  await tab.goto(`${origin}/?${new URLSearchParams({ height, gimbal })}`);
  const counter = await browser.newPage();

  // A worker draws the plots, so only a picture of the page shows their pixels.
  async function covered() {
    const bytes = await tab.screenshot({ encoding: "base64" });
    const boxes = await tab.$$eval("canvas", (all) =>
      all.map((canvas) => canvas.getBoundingClientRect()).map(({ x, y, width, height }) => ({ x, y, width, height })),
    );
    // The plots are the two on the left.
    const plots = boxes.filter(({ width, height }) => width > 200 && height > 200).sort((a, b) => a.x - b.x || a.y - b.y);
    const count = async (source, places, colorful) => {
      const image = new Image();
      image.src = `data:image/png;base64,${source}`;
      await image.decode();
      const canvas = new OffscreenCanvas(image.width, image.height);
      const context = canvas.getContext("2d");
      context.drawImage(image, 0, 0);
      return places.map(({ x, y, width, height }) => {
        const { data } = context.getImageData(x, y, width, height);
        let pixels = 0;
        for (let at = 0; at < data.length; at += 4) {
          const color = data.slice(at, at + 3);
          pixels += Math.max(...color) - Math.min(...color) > colorful ? 1 : 0;
        }
        return pixels;
      });
    };
    return counter.evaluate(count, bytes, plots.slice(0, 2), COLORFUL);
  }

  const deadline = Date.now() + PATIENCE_MS;
  let pixels = [];
  let before = "";
  // When two pictures in a row are the same, everything is read.
  for (;;) {
    await tab.bringToFront();
    await new Promise((resolve) => setTimeout(resolve, 2000));
    pixels = await covered();
    const now = JSON.stringify(pixels);
    const drawn = pixels.length === 2 && pixels.every((count) => count > LINE_PIXELS_MIN);
    if ((drawn && now === before) || Date.now() > deadline) break;
    before = now;
  }
  await tab.screenshot({ path: picture });
  const words = await tab.evaluate(() => document.body.innerText);
  console.log(JSON.stringify({ words, pixels, crashes }));
} finally {
  await browser.close();
  server.close();
}
