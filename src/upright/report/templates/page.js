"use strict";
// evidence is opened for paper and closed again; a link into it opens it
(() => {
  let opened = [];
  addEventListener("beforeprint", () => { opened = [...document.querySelectorAll("details:not([open])")]; for (const d of opened) d.open = true; });
  addEventListener("afterprint", () => { for (const d of opened) d.open = false; });
  const reveal = () => { const at = document.getElementById(decodeURIComponent(location.hash.slice(1))); const d = at && at.closest("details"); if (d) d.open = true; };
  addEventListener("hashchange", reveal);
  reveal();
  const links = [...document.querySelectorAll(".toc a")];
  const follow = () => {
    const passed = links.filter((a) => { const at = document.getElementById(a.hash.slice(1)); return at && at.getBoundingClientRect().top < 140; });
    const now = passed.pop() || links[0];
    for (const a of links) a === now ? a.setAttribute("aria-current", "true") : a.removeAttribute("aria-current");
  };
  addEventListener("scroll", follow, { passive: true });
  follow();
})();
