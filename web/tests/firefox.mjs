import { spawn, spawnSync } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';

/// Firefox, driven by WebDriver BiDi: UPSWING_FIREFOX, or a program on the PATH. Undefined without one,
/// or without WebSocket, for which Node 20 needs --experimental-websocket.
export const firefox = globalThis.WebSocket
  ? [process.env.UPSWING_FIREFOX, 'firefox-esr', 'firefox'].find(
      (program) => program && spawnSync(program, ['--version']).status === 0,
    )
  : undefined;

/// Opens an address in a new Firefox and returns the result of `call` there, which may be a promise.
export async function inFirefox(address, call) {
  const profile = mkdtempSync(join(tmpdir(), 'upswing-firefox-'));
  const given = ['--headless', '--no-remote', '--profile', profile, '--remote-debugging-port', '0'];
  const browser = spawn(firefox, given, { stdio: ['ignore', 'ignore', 'pipe'] });
  try {
    // It prints the address of the socket on which it accepts commands.
    const endpoint = await new Promise((resolve, reject) => {
      let text = '';
      browser.on('error', reject);
      browser.stderr.on('data', (data) => {
        const found = /WebDriver BiDi listening on (\S+)/.exec((text += data));
        if (found) resolve(found[1]);
      });
    });
    const socket = new WebSocket(`${endpoint}/session`);
    await new Promise((resolve) => (socket.onopen = resolve));
    const waiting = new Map();
    socket.onmessage = ({ data }) => {
      const { id, type, result, message } = JSON.parse(data);
      const { resolve, reject } = waiting.get(id) ?? {};
      if (type === 'success') resolve?.(result);
      else if (type === 'error') reject?.(new Error(message));
    };
    const command = (method, params) =>
      new Promise((resolve, reject) => {
        const id = waiting.size + 1;
        waiting.set(id, { resolve, reject });
        socket.send(JSON.stringify({ id, method, params }));
      });
    await command('session.new', { capabilities: {} });
    const { contexts } = await command('browsingContext.getTree', {});
    const { context } = contexts[0];
    await command('browsingContext.navigate', { context, url: address, wait: 'complete' });
    const { result, exceptionDetails } = await command('script.callFunction', {
      functionDeclaration: String(call),
      target: { context },
      awaitPromise: true,
    });
    if (exceptionDetails) throw new Error(exceptionDetails.text);
    return result.value;
  } finally {
    browser.kill();
    await new Promise((resolve) => browser.on('exit', resolve));
    rmSync(profile, { recursive: true });
  }
}
