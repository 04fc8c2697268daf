// What the theme leaves out for readers with a keyboard or a screen reader: levels of headings, names of links, focus for parts that scroll.
document.addEventListener("DOMContentLoaded", () => {
  for (const caption of document.querySelectorAll('[role="heading"]:not([aria-level])')) caption.setAttribute("aria-level", "2");
  for (const link of document.querySelectorAll(".sphx-glr-thumbcontainer a")) link.setAttribute("aria-label", link.textContent);
  for (const part of document.querySelectorAll("pre, .table-wrapper, .content table, div.math"))
    if (part.scrollWidth > part.clientWidth) part.tabIndex = 0;
});
