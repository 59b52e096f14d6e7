// Which model of the rig is in use, and how another one comes into use.

import { lock, message } from "./bar";
import { byId, say } from "./dom";
import type { Session } from "./session";
import { modelName } from "./words";

const DESIGNING = "A law is being designed for this model; the page is loaded again when it is there.";

export class Model {
  private designing = false;
  /** What this page said of how the rig was used last. */
  private said = "";

  constructor(private readonly session: Session) {
    for (const id of ["nominal", "fit-use", "use-again"]) byId(id).addEventListener("click", () => void this.use(byId(id)));
  }

  /** Says which model is in use, and locks what would change it. */
  show(): void {
    const { scene, state, unsteerable } = this.session;
    if (!scene) return;
    for (const place of document.querySelectorAll(".in-use")) say(place, modelName(scene.model));
    const runs = state?.state === "running" || state?.state === "starting" ? "The rig runs; stop it first." : "";
    const why = unsteerable || (this.designing ? DESIGNING : "") || runs;
    byId("nominal").hidden = !scene.model.fit;
    lock(byId("nominal"), why);
    const last = scene.last_use?.sentence ?? "";
    say(byId("last-use"), last);
    byId("last-use").hidden = !last;
    byId("use-again").hidden = !scene.last_use?.offer;
    lock(byId("use-again"), why);
    if (last !== this.said && last) message(last);
    this.said = last;
    const use = byId("fit-use"), { fit } = use.dataset;
    lock(use, why || (fit === scene.model.fit ? "This fit is in use already." : ""));
    say(use, fit === scene.model.fit ? "In use" : "Use this fit");
  }

  private async use(button: HTMLElement): Promise<void> {
    const { why, fit = "" } = button.dataset, offer = button.id === "use-again" ? this.session.scene?.last_use?.offer : undefined;
    if (why) return message(why);
    this.designing = true;
    message(DESIGNING);
    this.show();
    const refused = await this.session.describe(offer ?? { fit });
    this.designing = false;
    if (refused) message(refused); // else the page is loaded again
    this.show();
  }
}
