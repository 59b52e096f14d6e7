// A report is a page of its own within this one: it is seen once the key that stops the rig is heard there too.

export class ReportFrame {
  constructor(private readonly frame: HTMLIFrameElement, stop: () => void) {
    frame.addEventListener("load", () => {
      frame.contentWindow?.addEventListener("keydown", (event) => { if (event.key === "Escape") stop(); }, { capture: true });
      frame.classList.remove("unheard");
    });
  }

  /** Loads a report, in the panel that the frame stands in. */
  show(address: string): void {
    const panel = this.frame.closest<HTMLElement>(".panel")!;
    this.frame.classList.add("unheard");
    this.frame.src = address;
    panel.hidden = false;
    panel.scrollIntoView();
  }
}
