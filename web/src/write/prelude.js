'use strict';
// Goes before a visitor's controller, the function torque(), in its worker. Leaves it the language
// without clock, chance and everything that a browser adds.
(() => {
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
    // Rows of q1, q2, w1, w2, t; answers a torque for each.
    port.onmessage = ({ data }) => {
      const torques = new Float64Array(data.length / 5);
      for (let i = 0; i < torques.length; ++i) {
        const [q1, q2, w1, w2, t] = data.subarray(5 * i, 5 * i + 5);
        const value = torque(q1, q2, w1, w2, t);
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
      if (configurable && name !== 'constructor' && !KEPT.has(name)) delete scope[name];
    }
  }
  Math.random = () => {
    throw new Error('there is no Math.random, because the same lines have to get the same score');
  };
})();
