import type { Scene } from '../view/scene';
import { warn } from './message';
import { saveFile } from './save';

const SECONDS = 5;
const SIDE = 720; // px
const TITLE = 112; // px, of the title below
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

/// Films pendulums side by side for five seconds and saves the film. Throws the recorder's errors.
async function film(
  scenes: readonly Scene[],
  title: () => readonly [string, string],
): Promise<void> {
  const picture = document.createElement('canvas');
  picture.width = SIDE * scenes.length;
  picture.height = SIDE + TITLE;
  const context = picture.getContext('2d')!;
  const recorder = new MediaRecorder(picture.captureStream(), { mimeType: filmType! });
  const pieces: Blob[] = [];
  recorder.ondataavailable = ({ data }) => pieces.push(data);
  const stopped = new Promise((resolve) => (recorder.onstop = resolve));
  const end = performance.now() + 1000 * SECONDS;
  const frame = (): void => {
    draw(
      context,
      scenes,
      [...title(), shownAddress()].filter((line) => line !== ''),
    );
    if (performance.now() < end) requestAnimationFrame(frame);
    else recorder.stop();
  };
  recorder.start();
  frame();
  await stopped;
  for (const track of recorder.stream.getTracks()) track.stop();
  const type = recorder.mimeType;
  saveFile(new Blob(pieces, { type }), `upswing.${type.includes('mp4') ? 'mp4' : 'webm'}`);
}

/// Draws the square around each pendulum, and up to three lines below.
function draw(
  context: CanvasRenderingContext2D,
  scenes: readonly Scene[],
  lines: readonly string[],
): void {
  const { canvas } = scenes[0]!;
  const { width, height } = context.canvas;
  context.fillStyle = canvas.color('page');
  context.fillRect(0, 0, width, height);
  scenes.forEach((scene, i) => {
    const { x, y, half } = scene.square;
    const ratio = scene.canvas.element.width / scene.canvas.width;
    const [left, top, side] = [x - half, y - half, 2 * half].map((length) => length * ratio);
    const { element } = scene.canvas;
    context.drawImage(element, left!, top!, side!, side!, i * SIDE, 0, SIDE, SIDE);
  });
  context.textAlign = 'center';
  lines.forEach((line, i) => {
    context.font = canvas.font(i === 0 ? '600 30px' : '24px');
    context.fillStyle = canvas.color(i === 0 ? 'ink' : 'quiet');
    context.fillText(line, width / 2, SIDE + 26 + 34 * i, width - 40);
  });
}

/// The page's address for people.
function shownAddress(): string {
  if (location.protocol === 'file:') return 'Upswing';
  return `${location.host}${location.pathname}`.replace(/\/(index\.html)?$/, '');
}
