// SPDX-License-Identifier: Apache-2.0
// Chromium without a window, spoken to through a pipe: no port is opened, no library is needed.
import { spawn, spawnSync } from "node:child_process";
import { mkdirSync, mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

export function find_chromium() {
  for (const name of ["chromium", "chromium-browser", "google-chrome"]) {
    const found = spawnSync("sh", ["-c", `command -v ${name}`], { encoding: "utf8" }).stdout.trim();
    if (found) return found;
  }
  return null;
}

export const sleep = (ms) => new Promise((wake) => setTimeout(wake, ms));

export class Browser {
  #process;
  #folder = mkdtempSync(join(tmpdir(), "organ-browser-"));
  #next = 1;
  #answers = new Map();
  #rest = "";
  requests = [];   // what was asked of any server, and the page itself
  complaints = []; // of the console, and what the page threw

  static async start(width, height, more = []) {
    const browser = new Browser();
    browser.#process = spawn(find_chromium(), [
      "--headless=new", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-extensions",
      "--use-angle=swiftshader",
      "--enable-unsafe-swiftshader", "--disable-background-networking", "--disable-dev-shm-usage",
      "--remote-debugging-pipe",
      `--user-data-dir=${browser.#folder}`, `--window-size=${width},${height}`, ...more, "about:blank",
    ], { stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"] });
    process.on("exit", () => browser.#process.kill());  // whatever became of the test
    browser.#process.stdio[4].on("data", (data) => browser.#hear(data));
    const { targetInfos } = await browser.#send("Target.getTargets");
    const page = targetInfos.find((target) => target.type === "page");
    const { sessionId } = await browser.#send("Target.attachToTarget", { targetId: page.targetId, flatten: true });
    browser.session = sessionId;
    for (const domain of ["Page", "Runtime", "Log", "Network"]) await browser.send(`${domain}.enable`);
    await browser.send("Emulation.setDeviceMetricsOverride", { width, height, deviceScaleFactor: 1, mobile: false });
    return browser;
  }

  #hear(data) {
    const messages = (this.#rest + data).split("\0");
    this.#rest = messages.pop();
    for (const text of messages) {
      const message = JSON.parse(text);
      if (message.id) {
        const { resolve, reject } = this.#answers.get(message.id);
        this.#answers.delete(message.id);
        if (message.error) reject(new Error(message.error.message));
        else resolve(message.result);
      } else if (message.method === "Network.requestWillBeSent") {
        this.requests.push(message.params.request.url);
      } else if (message.method === "Runtime.exceptionThrown") {
        this.complaints.push(message.params.exceptionDetails.text);
      } else if (message.method === "Runtime.consoleAPICalled" && message.params.type !== "log") {
        this.complaints.push(JSON.stringify(message.params.args));
      } else if (message.method === "Log.entryAdded" && message.params.entry.level !== "verbose") {
        this.complaints.push(message.params.entry.text);
      }
    }
  }
  #send(method, params = {}, sessionId = undefined) {
    const id = this.#next++;
    this.#process.stdio[3].write(JSON.stringify({ id, method, params, sessionId }) + "\0");
    return new Promise((resolve, reject) => this.#answers.set(id, { resolve, reject }));
  }
  send(method, params) { return this.#send(method, params, this.session); }

  async open(file, hash = "") {
    this.requests = [];
    this.complaints = [];
    await this.send("Page.navigate", { url: `file://${file}${hash}` });
  }
  // The value of an expression in the page, awaited.
  async value(expression) {
    const answer = await this.send("Runtime.evaluate", { expression, awaitPromise: true, returnByValue: true });
    if (answer.exceptionDetails) throw new Error(answer.exceptionDetails.exception?.description ?? "it threw");
    return answer.result.value;
  }
  // Until the expression is true; throws after so many seconds.
  async until(expression, seconds = 60) {
    for (const end = Date.now() + 1000 * seconds; Date.now() < end;) {
      if (await this.value(expression)) return;
      await sleep(50);
    }
    throw new Error(`never came: ${expression}`);
  }
  mouse(type, x, y, more = {}) {
    return this.send("Input.dispatchMouseEvent",
                     { type, x, y, button: "left", buttons: type === "mouseReleased" ? 0 : 1, clickCount: 1, ...more });
  }
  key(type, key, more = {}) { return this.send("Input.dispatchKeyEvent", { type, key, ...more }); }
  touch(type, points) { return this.send("Input.dispatchTouchEvent", { type, touchPoints: points }); }
  async screenshot() {
    return Buffer.from((await this.send("Page.captureScreenshot", { format: "png" })).data, "base64");
  }
  // Into a folder, where one was named.
  async keep(folder, name) {
    if (!folder) return;
    mkdirSync(folder, { recursive: true });
    writeFileSync(join(folder, `${name}.png`), await this.screenshot());
  }

  async close() {
    const gone = new Promise((resolve) => this.#process.on("exit", resolve));
    await this.#send("Browser.close").catch(() => {});
    await gone;
    rmSync(this.#folder, { recursive: true, force: true });
  }
}
