import type { History } from '../history';
import { note } from './message';

/// Saves a trajectory as CSV.
export function save(history: History): void {
  if (!history.last) return note('There is no trajectory yet.');
  const link = document.createElement('a');
  link.href = URL.createObjectURL(new Blob([history.csv()], { type: 'text/csv' }));
  link.download = 'trajectory.csv';
  link.click();
  URL.revokeObjectURL(link.href);
}
