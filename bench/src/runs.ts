// Screen Runs: what has been run, its log as a file, its report.

import { byId, make, say } from "./dom";
import { ReportFrame } from "./frame";
import type { Session } from "./session";

interface Ran {
  id: string;
  /** Seconds since 1970. */
  started: number;
  seconds: number;
  verdict: string;
  log?: string;
  report?: string;
}

const SOON = 1000; // ms, while a report is written whose log may be there before it

export class Runs {
  private readonly frame: ReportFrame;
  private timer = 0;

  constructor(private readonly session: Session) {
    this.frame = new ReportFrame(byId("report"), () => session.stop());
  }

  async show(): Promise<void> {
    clearTimeout(this.timer);
    if (this.session.state?.writing && !byId("runs").hidden) this.timer = window.setTimeout(() => void this.show(), SOON);
    const answer = await fetch(`/api/rigs/${encodeURIComponent(this.session.name)}/runs`).catch(() => undefined);
    if (!answer?.ok) return;
    const ran = (await answer.json()) as Ran[];
    byId("no-runs").hidden = ran.length > 0 || this.session.state?.writing === true;
    byId("runs-table").hidden = ran.length === 0;
    const { unreadable } = this.session;
    say(byId("runs-unreadable"), unreadable);
    byId("runs-unreadable").hidden = !unreadable || ran.length === 0;
    byId("runs-rows").replaceChildren(...ran.map((run) => {
      const files = make("td", { class: "files" }), when = this.when(run.started);
      if (run.report && !unreadable) {
        const button = make("button", { type: "button" }, "Report");
        const { report } = run;
        button.addEventListener("click", () => this.report(report, when));
        files.append(button);
      }
      if (run.log && !unreadable) files.append(make("a", { href: this.session.file(run.log), download: "" }, "Log"));
      return make("tr", {}, make("th", { scope: "row" }, when), make("td", {}, run.seconds.toFixed(1)), make("td", {}, run.verdict || "Its report is not written yet."), files);
    }));
  }

  private when(started: number): string {
    return new Date(1000 * started).toLocaleString("en-GB", { dateStyle: "medium", timeStyle: "medium" });
  }

  private report(address: string, when: string): void {
    say(byId("report-title"), `Report of the run of ${when}`);
    this.frame.show(this.session.file(address));
  }
}
