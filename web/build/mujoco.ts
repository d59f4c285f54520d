import type { Plugin } from 'vite';

/// Prepares the official MuJoCo build for the page: its JavaScript without code made from text, which
/// a strict Content-Security-Policy forbids, and its WebAssembly without debug sections.

/// Emscripten writes the function that calls into C++ as text and compiles it. The same as a closure.
const INVOKER = `(function () {
  var first = isClassMethodFunc ? 1 : 2;
  return function (...given) {
    checkArgCount(given.length, minArgs, expectedArgCount, humanName, throwBindingError);
    var destructors = needsDestructorStack ? [] : null;
    var wired = [];
    for (var i = first; i < argTypes.length; ++i) {
      wired.push(argTypes[i].toWireType(destructors, i === 1 ? this : given[i - 2]));
    }
    var rv = cppInvokerFunc(cppTargetFunc, ...wired);
    if (needsDestructorStack) runDestructors(destructors);
    for (var i = first; !needsDestructorStack && i < argTypes.length; ++i) {
      if (argTypes[i].destructorFunction !== null) argTypes[i].destructorFunction(wired[i - first]);
    }
    return returns ? argTypes[0].fromWireType(rv) : undefined;
  };
})()`;

/// The same for the function through which C++ calls JavaScript.
const METHOD_CALLER = `(obj, func, destructorsRef, args) => {
  var values = types.map((type) => {
    var value = type.readValueFromPointer(args);
    args += type.argPackAdvance;
    return value;
  });
  var rv = kind === 1 ? new func(...values) : func.call(...(kind === 0 ? [obj] : []), ...values);
  return retType.isVoid ? undefined : emval_returnValue(retType, destructorsRef, rv);
}`;

const REPLACEMENTS: [string, string][] = [
  ['new Function(...args, invokerFnBody)(...closureArgs)', INVOKER],
  ['new Function(...params, functionBody)(...args)', METHOD_CALLER],
  // Code for Node, and checks of the calling code.
  [
    "var ENVIRONMENT_IS_NODE = typeof process == 'object' && process.versions?.node && process.type != 'renderer'",
    'const ENVIRONMENT_IS_NODE = false',
  ],
  ['function assert(', '/* @__NO_SIDE_EFFECTS__ */ function assert('],
  // Messages for those who use what the build leaves out.
  ['missingLibrarySymbols.forEach(missingLibrarySymbol)', ''],
  ['unexportedSymbols.forEach(unexportedRuntimeSymbol);', ''],
];

/// The module with its sections of names and debugging notes left out (custom sections, id 0).
export function stripCustomSections(wasm: Uint8Array): Uint8Array {
  const kept: Uint8Array[] = [wasm.subarray(0, 8)]; // magic number and version
  let at = 8;
  while (at < wasm.length) {
    const start = at;
    const id = wasm[at++];
    let size = 0; // LEB128
    for (let shift = 0, byte = 0x80; byte & 0x80; shift += 7) {
      byte = wasm[at++]!;
      size |= (byte & 0x7f) << shift;
    }
    at += size;
    if (id !== 0) kept.push(wasm.subarray(start, at));
  }
  return Buffer.concat(kept);
}

export function mujoco(): Plugin {
  return {
    name: 'mujoco',
    enforce: 'pre',
    transform(code, id) {
      if (!id.endsWith('@mujoco/mujoco/mujoco.js')) return null;
      for (const [text, closure] of REPLACEMENTS) {
        if (code.split(text).length !== 2) this.error(`expected "${text}" once in ${id}`);
        code = code.replace(text, () => closure);
      }
      return { code, map: null };
    },
    generateBundle(_, bundle) {
      for (const file of Object.values(bundle)) {
        if (file.type === 'asset' && file.fileName.endsWith('.wasm')) {
          file.source = stripCustomSections(file.source as Uint8Array);
        }
      }
    },
  };
}
