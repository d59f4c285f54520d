import type { History } from '../history';
import { note } from './message';

/// Lets the browser save a file under a name.
export function saveFile(file: Blob, name: string): void {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(file);
  link.download = name;
  link.click();
  URL.revokeObjectURL(link.href);
}

/// Saves a trajectory as CSV.
export function save(history: History): void {
  if (!history.last) return note('There is no trajectory yet.');
  saveFile(new Blob([history.csv()], { type: 'text/csv' }), 'trajectory.csv');
}
