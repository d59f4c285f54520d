import { expect, test } from 'vitest';
import { BEGINNING, decode, encode } from './share';
import { viewOf } from './views';

test('an address without settings is a new visitor', () => {
  for (const hash of ['', '#'])
    expect(viewOf(hash)).toEqual({ name: 'tour', step: 1, chosen: false });
});

test('each view has an address of its own', () => {
  expect(viewOf('#tour')).toMatchObject({ name: 'tour', chosen: true });
  expect(viewOf('#tour=3')).toMatchObject({ name: 'tour', step: 3, chosen: true });
  expect(viewOf('#learn')).toMatchObject({ name: 'learn' });
  expect(viewOf('#everything')).toMatchObject({ name: 'everything', chosen: true });
  expect(decode('#everything', new Map(), () => false).problems).toEqual([]);
});

test('settings show everything, without a choice for the next visit', () => {
  const hash = `#${encode({ ...BEGINNING, agent: 'fast', on: true })}`;
  expect(viewOf(hash)).toMatchObject({ name: 'everything', chosen: false });
  expect(viewOf('#mass1=2')).toMatchObject({ name: 'everything', chosen: false });
});
