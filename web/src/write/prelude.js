'use strict';
// Goes before a visitor's controller, the function torque(), in its worker. Leaves it the language
// without clock, chance and everything that a browser adds. sandbox.ts fills in its length.
(() => {
  // Lines that close their function would run on their own, and their declarations would be hoisted
  // over the names below. They make the function's text shorter. Nothing of theirs has run yet.
  const source = torque.toString();
  if (source.length !== SOURCE_LENGTH) {
    throw `a bracket in row ${source.split('\n').length - 1} closes the controller's function`;
  }
  const KEPT = new Set([
    ...[
      'Array',
      'BigInt',
      'Boolean',
      'Error',
      'Float32Array',
      'Float64Array',
      'Function',
      'Infinity',
    ],
    ...['Int32Array', 'JSON', 'Map', 'Math', 'NaN', 'Number', 'Object', 'RangeError'],
    ...['ReferenceError', 'RegExp', 'Set', 'String', 'Symbol', 'SyntaxError', 'TypeError'],
    ...['globalThis', 'isFinite', 'isNaN', 'parseFloat', 'parseInt', 'torque', 'undefined'],
  ]);
  const { Float64Array } = globalThis;
  addEventListener('message', ({ ports: [port] }) => {
    const send = port.postMessage.bind(port);
    send('ready');
    // Rows of q1, q2, w1, w2, t; answers a torque for each. The controller may have altered every
    // prototype, so nothing here iterates or calls a method.
    port.onmessage = ({ data }) => {
      const torques = new Float64Array(data.length / 5);
      for (let i = 0; i < torques.length; ++i) {
        const k = 5 * i;
        const t = data[k + 4];
        const value = torque(data[k], data[k + 1], data[k + 2], data[k + 3], t);
        if (typeof value !== 'number') return send([t, value === null ? 'null' : typeof value]);
        if (value !== value) return send([t, 'NaN']);
        torques[i] = value;
      }
      send(torques);
    };
  });
  for (let scope = globalThis; scope !== null; scope = Object.getPrototypeOf(scope)) {
    if (scope === Object.prototype) break;
    for (const name of Object.getOwnPropertyNames(scope)) {
      const { configurable } = Object.getOwnPropertyDescriptor(scope, name);
      if (configurable && !KEPT.has(name)) delete scope[name];
    }
  }
  // Texts in the visitor's language differ between visitors.
  for (const { prototype } of [Array, BigInt, Float64Array, Number, Object, String]) {
    for (const scope of [prototype, Object.getPrototypeOf(prototype) ?? prototype]) {
      for (const name of Object.getOwnPropertyNames(scope)) {
        if (/^(toLocale|localeCompare)/.test(name)) delete scope[name];
      }
    }
  }
  Math.random = () => {
    throw new Error('there is no Math.random, because the same lines have to get the same score');
  };
})();
