// A worker with a share of the rigs that the fit allows; loaded with the rig's name as its own.

const assets = "/assets/";
importScripts(`${assets}kernel.js`, `${assets}twin.js`, `/rigs/${encodeURIComponent(self.name)}/twin.js`);
const ensemble = new Ensemble(DATA);
onmessage = ({ data }: MessageEvent<Parameters<Ensemble["words"]>>) => postMessage(ensemble.words(...data));
