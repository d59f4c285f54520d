import { saveFile } from './save';
import type { Canvas } from '../view/canvas';

const SECONDS = 5;
const SIDE = 720; // px
const TITLE = 80; // px, of the title below
const TYPES = ['video/webm;codecs=vp9', 'video/webm', 'video/mp4'];

/// The format of films in this browser; undefined if it records none.
export const filmType =
  typeof MediaRecorder === 'undefined'
    ? undefined
    : TYPES.find((type) => MediaRecorder.isTypeSupported(type));

/// Films a square of a canvas for five seconds and saves the film as `name` with an extension.
/// Throws the recorder's errors. `middle` gives the square's centre and half its side (px of the
/// style sheet), `title` two lines below it.
export async function film(
  canvas: Canvas,
  middle: () => { x: number; y: number; half: number },
  name: string,
  title: () => readonly [string, string],
): Promise<void> {
  const picture = document.createElement('canvas');
  picture.width = SIDE;
  picture.height = SIDE + TITLE;
  const context = picture.getContext('2d')!;
  const recorder = new MediaRecorder(picture.captureStream(), { mimeType: filmType! });
  const pieces: Blob[] = [];
  recorder.ondataavailable = ({ data }) => pieces.push(data);
  const stopped = new Promise((resolve) => (recorder.onstop = resolve));
  const end = performance.now() + 1000 * SECONDS;
  const ground = canvas.color('page');
  const frame = (): void => {
    const { x, y, half } = middle();
    const ratio = canvas.element.width / canvas.width;
    context.fillStyle = ground;
    context.fillRect(0, 0, SIDE, SIDE + TITLE);
    const [left, top, side] = [x - half, y - half, 2 * half].map((length) => length * ratio);
    context.drawImage(canvas.element, left!, top!, side!, side!, 0, 0, SIDE, SIDE);
    context.textAlign = 'center';
    title().forEach((line, i) => {
      context.font = canvas.font(i === 0 ? '600 30px' : '24px');
      context.fillStyle = canvas.color(i === 0 ? 'ink' : 'quiet');
      context.fillText(line, SIDE / 2, SIDE + 28 + 34 * i, SIDE - 40);
    });
    if (performance.now() < end) requestAnimationFrame(frame);
    else recorder.stop();
  };
  recorder.start();
  frame();
  await stopped;
  for (const track of recorder.stream.getTracks()) track.stop();
  const type = recorder.mimeType;
  saveFile(new Blob(pieces, { type }), `${name}.${type.includes('mp4') ? 'mp4' : 'webm'}`);
}
