// A canvas before it is drawn on: as many pixels as the screen has there, empty, in the page's letters and colours.

export interface Surface {
  c: CanvasRenderingContext2D;
  /** [px of the page] */
  width: number;
  height: number;
  /** Colour of a custom property. */
  tone: (name: string) => string;
}

/** Undefined where the canvas is not seen. */
export function surface(canvas: HTMLCanvasElement): Surface | undefined {
  const width = canvas.clientWidth, height = canvas.clientHeight, dense = devicePixelRatio || 1;
  if (!width || !height) return undefined;
  const across = Math.round(width * dense), up = Math.round(height * dense);
  if (canvas.width !== across || canvas.height !== up) [canvas.width, canvas.height] = [across, up];
  const c = canvas.getContext("2d")!, style = getComputedStyle(document.documentElement);
  c.setTransform(dense, 0, 0, dense, 0, 0);
  c.clearRect(0, 0, width, height);
  c.font = `13px ${style.getPropertyValue("--sans")}`;
  return { c, width, height, tone: (name) => style.getPropertyValue(name).trim() };
}
