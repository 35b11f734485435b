/** A canvas in the pixels of the screen. */

/** Size a canvas to its width on the page and `height`; return its empty context, in the units of the page, and that width. */
export function cleared(canvas, height) {
  const width = canvas.clientWidth;
  canvas.width = width * devicePixelRatio;
  canvas.height = height * devicePixelRatio;
  canvas.style.height = `${height}px`;
  const ctx = canvas.getContext("2d");
  ctx.scale(devicePixelRatio, devicePixelRatio);
  return { ctx, width };
}
