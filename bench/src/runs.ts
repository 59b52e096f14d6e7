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

export class Runs {
  private readonly frame: ReportFrame;

  constructor(private readonly session: Session) {
    this.frame = new ReportFrame(byId("report"), () => session.stop());
  }

  async show(): Promise<void> {
    const answer = await fetch(`/api/rigs/${encodeURIComponent(this.session.name)}/runs`).catch(() => undefined);
    if (!answer?.ok) return;
    const ran = (await answer.json()) as Ran[];
    byId("no-runs").hidden = ran.length > 0 || this.session.state?.writing === true;
    byId("runs-table").hidden = ran.length === 0;
    byId("runs-rows").replaceChildren(...ran.map((run) => {
      const files = make("td", { class: "files" }), when = this.when(run.started);
      if (run.report) {
        const button = make("button", { type: "button" }, "Report");
        const { report } = run;
        button.addEventListener("click", () => this.report(report, when));
        files.append(button);
      }
      if (run.log) files.append(make("a", { href: run.log, download: "" }, "Log"));
      return make("tr", {}, make("th", { scope: "row" }, when), make("td", {}, run.seconds.toFixed(1)), make("td", {}, run.verdict), files);
    }));
  }

  private when(started: number): string {
    return new Date(1000 * started).toLocaleString("en-GB", { dateStyle: "medium", timeStyle: "medium" });
  }

  private report(address: string, when: string): void {
    say(byId("report-title"), `Report of the run of ${when}`);
    this.frame.show(address);
  }
}
