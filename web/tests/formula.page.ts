import { expect } from '@playwright/test';
import { open, test } from './page';

test('brackets of formulas are as tall as their letters, whatever the height of their row', async ({
  stage: page,
}) => {
  await open(page, '#how');
  const tall = await page.evaluate(() => {
    for (const details of document.querySelectorAll('details')) details.open = true;
    const brackets = Array.from(document.querySelectorAll('mo')).filter((one) =>
      ['(', ')'].includes(one.textContent),
    );
    return brackets.map((one) => one.getBoundingClientRect().height / letter(one));

    function letter(one: Element): number {
      return parseFloat(getComputedStyle(one).fontSize);
    }
  });
  expect(tall.length).toBeGreaterThan(10);
  expect(Math.max(...tall)).toBeLessThan(1.8);
});
