// What becomes of the rigs that the fit allows, shared among workers; the page itself answers where a browser has none.

type Question = [settings: TwinSettings, gains: number[]];
type Hand = (...question: [...Question, first: number, after: number]) => Promise<Fate[]>;

function workers(rig: string): Hand[] {
  return Array.from({ length: Math.max(1, Math.min(4, (navigator.hardwareConcurrency || 2) - 1)) }, () => {
    const worker = new Worker("/assets/worker.js", { name: rig });
    return (...question) => new Promise((resolve, reject) => {
      worker.onmessage = ({ data }: MessageEvent<Fate[]>) => resolve(data);
      worker.onerror = () => reject(new Error("no worker"));
      worker.postMessage(question);
    });
  });
}

function alone(): Hand[] {
  const here = new Ensemble(DATA);
  return [(...question) => Promise.resolve(here.words(...question))];
}

/** Answers the newest question; questions that a newer one overtakes stay unanswered. */
export class Answers {
  private hands: Hand[];
  private waiting: Question | undefined;
  private busy = false;
  /** Whether the newest question is still open. */
  open = false;

  constructor(rig: string, private readonly answered: (fates: Fate[], milliseconds: number) => void) {
    this.hands = workers(rig);
  }

  async ask(...question: Question): Promise<void> {
    this.waiting = question;
    this.open = true;
    if (this.busy) return;
    this.busy = true;
    while (this.waiting) {
      const [settings, gains] = this.waiting, start = performance.now();
      this.waiting = undefined;
      const fates = await this.shared(settings, gains).catch(() => {
        this.hands = alone();
        return this.shared(settings, gains);
      });
      this.open = this.waiting !== undefined;
      this.answered(fates, performance.now() - start);
    }
    this.busy = false;
  }

  private async shared(...question: Question): Promise<Fate[]> {
    const blocks = Math.ceil(DATA.lanes / DATA.many.width), each = Math.ceil(blocks / this.hands.length);
    const parts = this.hands.map((hand, i) => hand(...question, Math.min(blocks, i * each), Math.min(blocks, (i + 1) * each)));
    return (await Promise.all(parts)).flat();
  }
}
