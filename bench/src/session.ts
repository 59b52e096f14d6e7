// A rig as the page knows it now, and what may be asked of it.

import { Followed } from "./following";
import { History } from "./history";
import { type ClientRequest, type Scene, type State, type ServerMessage, decode } from "./protocol";
import { Connection } from "./socket";

const SECONDS = 10, ME = "upright-bench-me";
export const ANOTHER = "Another page operates this rig: you can stop it, you cannot steer it.";
const NO_CONNECTION = "There is no connection to the bench; the page tries again by itself.";
const UNHEARD_STOP =
  "STOP could not be sent: there is no connection to the bench. Use the rig's own switch. STOP is sent as soon as there is a connection again.";

export class Session {
  scene: Scene | undefined;
  state: State | undefined;
  history = new History([], 1);
  /** What the rig follows, and followed before. */
  readonly followed = new Followed();
  connected = false;
  private readonly connection: Connection;

  constructor(
    readonly name: string,
    private readonly on: { scene: () => void; state: (before: State | undefined) => void; message: (sentence: string) => void; steered: (request: ClientRequest) => void },
  ) {
    const url = `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/live/${encodeURIComponent(name)}`;
    // Who this page was before it was loaded again, or lost its connection, it is again.
    this.connection = new Connection(() => `${url}?me=${encodeURIComponent(sessionStorage.getItem(ME) ?? "")}`, {
      received: (received) => this.received(received),
      frame: (bytes) => this.scene && this.history.add(decode(bytes)),
      lost: () => this.lost(),
    });
  }

  get seconds(): number {
    return SECONDS;
  }

  /** Why the person at this page cannot steer the rig now; "" when they can. */
  get unsteerable(): string {
    if (!this.connected) return NO_CONNECTION;
    return this.state?.operator === "another" ? ANOTHER : "";
  }

  /** Why the files of this rig are not for the person at this page: in a class they are its operator's and the instructor's; "" when they are. */
  get unreadable(): string {
    const { classList } = document.body;
    if (!classList.contains("in-class") || classList.contains("instructs") || this.state?.operator === "you") return "";
    return `In a class, logs and reports of a twin are for its operator and the instructor; ${this.state?.operator === "another" ? "another page operates this one" : "take control first"}.`;
  }

  /** Address of a file of this rig; in a class with who wants it. */
  file(path: string): string {
    return document.body.classList.contains("in-class") ? `${path}?me=${encodeURIComponent(this.scene?.you ?? "")}` : path;
  }

  stop(): void {
    if (!this.connection.send({ do: "stop" })) this.on.message(UNHEARD_STOP);
  }

  release(): void {
    this.connection.send({ do: "release" });
  }

  /** Gives an request as operator, who this page becomes where nobody is. */
  steer(request: ClientRequest): void {
    if (this.unsteerable) return this.on.message(this.unsteerable);
    this.on.message("");
    if (this.state?.operator !== "you" && request.do !== "operate") this.connection.send({ do: "operate" });
    if (this.connection.send(request)) this.on.steered(request);
  }

  /** Lets a fit describe the rig, or what came with it where that is ""; or another filter give velocities; why not, or "". */
  async describe(by: { fit?: string; memory?: number }): Promise<string> {
    if (this.unsteerable) return this.unsteerable;
    const hardware = this.scene?.kind === "HARDWARE";
    if (hardware && !confirm("This changes what drives a real rig. Use it from the next start on?")) return "Nothing was changed.";
    const headers = { "x-bench-me": this.scene?.you ?? "" }, address = `/api/rigs/${encodeURIComponent(this.name)}/model`;
    const answer = await fetch(address, { method: "POST", headers, body: JSON.stringify(hardware ? { ...by, confirm: true } : by) }).catch(() => undefined);
    return answer?.ok ? "" : ((await answer?.text()) ?? NO_CONNECTION);
  }

  private received(received: ServerMessage): void {
    if (received.type === "scene") {
      // What the page computes with is the model's that it was loaded with.
      if (this.scene && (this.scene.model.fit !== received.model.fit || this.scene.memory !== received.memory)) return location.reload();
      const fresh = !this.connected;
      this.scene = received;
      this.followed.take(received.reference);
      sessionStorage.setItem(ME, received.you);
      this.connected = true;
      if (fresh) this.history = new History(received.coordinates.map((c) => c.per_unit), Math.round(SECONDS / received.period), received.period, received.memory);
      this.on.scene();
    } else if (received.type === "state") {
      const before = this.state;
      this.state = received;
      this.on.state(before);
    } else if (received.type === "error") this.on.message(received.sentence);
    else if (this.scene) {
      this.scene = { ...this.scene, poles: received.poles, K: received.K };
      this.on.scene();
      this.on.message(`The new gains act from tick ${received.at_tick}.`);
    }
  }

  private lost(): void {
    this.connected = false;
    this.on.state(this.state);
  }
}
