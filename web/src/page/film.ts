import type { Scene } from '../view/scene';
import { warn } from './message';
import { saveFile } from './save';

/// MP4 first, which phones and other programs show; then what other browsers record.
const TYPES = [
  'video/mp4;codecs=avc1.640028',
  'video/mp4;codecs=avc1.42E01F',
  'video/mp4',
  'video/webm;codecs=vp9',
  'video/webm',
];

/// The format of films in this browser; undefined if it records none.
const filmType =
  typeof MediaRecorder === 'undefined'
    ? undefined
    : TYPES.find((type) => MediaRecorder.isTypeSupported(type));

/// Makes every button of the class "film" film the `scenes` on the stage, with the lines of `title`
/// below them.
export function listenToFilms(
  scenes: () => readonly Scene[],
  title: () => readonly [string, string],
): void {
  document.documentElement.toggleAttribute('data-films', filmType !== undefined);
  addEventListener('click', ({ target }) => {
    const button = (target as Element).closest<HTMLButtonElement>('button.film');
    if (button) void press(button, () => film(scenes(), title));
  });
}

async function press(button: HTMLButtonElement, work: () => Promise<void>): Promise<void> {
  const { textContent } = button;
  button.disabled = true;
  button.textContent = 'Filming …';
  try {
    await work();
  } catch {
    warn('This browser could not film the stage.');
  }
  button.textContent = textContent;
  button.disabled = false;
}

/// Films and saves the film. The recorder is loaded when it is needed first.
async function film(
  scenes: readonly Scene[],
  title: () => readonly [string, string],
): Promise<void> {
  const { record } = await import('./recorder');
  const film = await record(scenes, title, filmType!);
  saveFile(film, `upswing.${film.type.includes('mp4') ? 'mp4' : 'webm'}`);
}
