import { setFlagsFromString } from 'node:v8';
import { runInNewContext } from 'node:vm';
import { expect, test } from 'vitest';
import { readPolicy } from '../tests/program';
import { CoreController } from './controller';
import { core } from './core';

test('frees a controller without references', async () => {
  setFlagsFromString('--expose-gc');
  const collect = runInNewContext('gc') as () => void;
  const file = readPolicy('fast');
  async function openAndForget(times: number): Promise<number> {
    for (let k = 0; k < times; ++k) {
      new CoreController(file.slice(0));
      if (k % 10 > 0) continue; // a garbage collection takes longer than opening a policy
      collect();
      await new Promise((resolve) => setTimeout(resolve, 0));
    }
    return core().exports.memory.buffer.byteLength;
  }
  const before = await openAndForget(20);
  const after = await openAndForget(100);
  expect(after - before).toBeLessThan(20 * file.byteLength);
});
