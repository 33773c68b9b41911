// The browser that the tests of both pages share. It draws by software, so that pixels and shaders take time of the processor:
// windows are used again, and pictures have few pixels.

import { fileURLToPath } from 'node:url';
import { chromium } from 'playwright-core';

/** Pixels of a picture whose size proves nothing. */
const PIXELS = 480 * 270;
export const SMALL = { width: 480, height: 270 };

/** Windows that show nothing, of each browser: a new one takes most of a second of the processor. */
const resting = new WeakMap();

/** Starts a Chromium without a screen; CHROMIUM names it. */
export const launch = () => chromium.launch({
  executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
  args: ['--no-sandbox', '--enable-unsafe-swiftshader', '--use-angle=swiftshader', '--disable-gpu-compositing'],
});

/** Whether a module is the program that node was asked for, and not a part of another. */
export const isProgram = (url) => process.argv[1] === fileURLToPath(url);

/** Does work with a browser of its own, and prints as a line of JSON what it returns. */
export async function alone(work) {
  const browser = await launch();
  try {
    console.log(JSON.stringify(await work(browser)));
  } finally {
    await browser.close();
  }
}

/**
 * An empty window with these preferences, in which these scripts, each with an argument, run before those of a page. Everything
 * on a page is as large as in any window, but its picture has few pixels, unless it is to be sharp.
 */
export async function emptyWindow(browser, options = {}) {
  const { viewport = SMALL, colorScheme = 'light', reducedMotion = 'reduce', scripts = [], sharp = false } = options;
  if (!resting.has(browser)) resting.set(browser, []);
  const page = resting.get(browser).pop() ?? await (await browser.newContext()).newPage();
  await page.setViewportSize(viewport);
  await page.emulateMedia({ colorScheme, reducedMotion });
  const share = sharp ? 1 : Math.min(1, Math.sqrt(PIXELS / (viewport.width * viewport.height)));
  const first = [(ratio) => Object.defineProperty(window, 'devicePixelRatio', { value: ratio }), share];
  const added = [];
  for (const [script, argument] of [first, ...scripts]) added.push(await page.addInitScript(script, argument));
  return {
    page,
    /** Closes it. */
    close: () => page.context().close(),
    /** Leaves the page, and what the window keeps of it, and lets another test have the window. */
    leave: async () => {
      await page.evaluate(() => sessionStorage.clear()).catch(() => undefined);
      silence(page);
      await page.goto('about:blank');
      for (const script of added) await script.dispose();
      resting.get(browser).push(page);
    },
  };
}

/** Ends what tests listen to. */
export function silence(page) {
  for (const event of ['console', 'pageerror', 'dialog', 'request']) page.removeAllListeners(event);
}

/** Takes WebGL 2 from a page, for a script that runs before it. */
export function blind() {
  const original = HTMLCanvasElement.prototype.getContext;
  HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
    return kind === 'webgl2' ? null : original.call(this, kind, ...rest);
  };
}

/** Two pictures of the screen later, what was asked for before is drawn. */
export const drawn = (page) => page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done()))));
