import type { Page } from './page';

declare global {
  /// The page, for the console of the browser and for tests.
  var upswing: Page;
}
