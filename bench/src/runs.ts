// Screen Runs: what has been run, its log as a file, its report.

import { byId, make, say } from "./dom";
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
  constructor(private readonly session: Session) {
    // A report is a page of its own: the key that stops the rig is heard there too.
    byId<HTMLIFrameElement>("report").addEventListener("load", ({ currentTarget }) => {
      (currentTarget as HTMLIFrameElement).contentWindow?.addEventListener("keydown", (event) => {
        if (event.key === "Escape") session.stop();
      }, { capture: true });
    });
  }

  async show(): Promise<void> {
    const answer = await fetch(`/api/rigs/${encodeURIComponent(this.session.name)}/runs`).catch(() => undefined);
    if (!answer?.ok) return;
    const ran = (await answer.json()) as Ran[];
    byId("no-runs").hidden = ran.length > 0;
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
    byId("report-panel").hidden = false;
    say(byId("report-title"), `Report of the run of ${when}`);
    byId<HTMLIFrameElement>("report").src = address;
    byId("report-panel").scrollIntoView();
  }
}
