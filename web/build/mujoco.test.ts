import { readFileSync } from 'node:fs';
import { describe, expect, test } from 'vitest';
import { stripCustomSections } from './mujoco';

/// Unsigned LEB128, padded with `padding` bytes that add nothing.
function leb128(value: number, padding = 0): number[] {
  const bytes = [];
  do {
    bytes.push(value & 0x7f);
    value >>>= 7;
  } while (value > 0);
  for (let i = 0; i < padding; ++i) bytes.push(0);
  return bytes.map((byte, i) => (i < bytes.length - 1 ? byte | 0x80 : byte));
}

const section = (id: number, content: number[], padding = 0) => [
  id,
  ...leb128(content.length, padding),
  ...content,
];
const custom = (name: string, content: number[], padding = 0) =>
  section(0, [name.length, ...Buffer.from(name), ...content], padding);

// (module (func (export "f") (result i32) i32.const 42)), section by section.
const HEAD = [0x00, 0x61, 0x73, 0x6d, 1, 0, 0, 0];
const TYPE = section(1, [1, 0x60, 0, 1, 0x7f]);
const FUNCTION = section(3, [1, 0]);
const EXPORT = section(7, [1, 1, 'f'.charCodeAt(0), 0, 0]);
const CODE = section(10, [1, 4, 0, 0x41, 42, 0x0b], 3);
const BARE = [...HEAD, ...TYPE, ...FUNCTION, ...EXPORT, ...CODE];

const strip = (bytes: number[]) => [...stripCustomSections(Uint8Array.from(bytes))];

describe('stripCustomSections', () => {
  test('drops custom sections wherever they stand and keeps the others byte for byte', () => {
    const long = new Array<number>(20000).fill(0xab); // a length of three bytes
    const dressed = [
      ...HEAD,
      ...custom('first', []),
      ...TYPE,
      ...custom('middle', long, 2),
      ...custom('again', [0, 0, 0]),
      ...FUNCTION,
      ...EXPORT,
      ...CODE,
      ...custom('name', [1, 2, 3]),
    ];
    expect(WebAssembly.validate(Uint8Array.from(dressed))).toBe(true);
    expect(strip(dressed)).toEqual(BARE);
    expect(strip(BARE)).toEqual(BARE);
  });

  test('what is left runs', async () => {
    const wasm = Uint8Array.from(strip([...BARE, ...custom('name', [7])]));
    const { instance } = await WebAssembly.instantiate(wasm);
    expect((instance.exports.f as () => number)()).toBe(42);
  });

  test("MuJoCo's own module loses more than half of its bytes, and no import or export", async () => {
    const path = import.meta.resolve('@mujoco/mujoco/mujoco.wasm');
    const whole = readFileSync(new URL(path));
    const stripped = stripCustomSections(whole);
    expect(stripped.length).toBeLessThan(whole.length / 2);
    const [before, after] = await Promise.all(
      [whole, Uint8Array.from(stripped)].map((bytes) => WebAssembly.compile(bytes)),
    );
    expect(WebAssembly.Module.customSections(after!, 'name')).toEqual([]);
    expect(WebAssembly.Module.imports(after!)).toEqual(WebAssembly.Module.imports(before!));
    expect(WebAssembly.Module.exports(after!)).toEqual(WebAssembly.Module.exports(before!));
  });
});
