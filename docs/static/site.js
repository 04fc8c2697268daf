// What the theme leaves out for readers with a keyboard or a screen reader: levels of headings, focus for parts that scroll.
document.addEventListener("DOMContentLoaded", () => {
  for (const caption of document.querySelectorAll('[role="heading"]:not([aria-level])')) caption.setAttribute("aria-level", "2");
  for (const part of document.querySelectorAll("pre, .table-wrapper, .content table, div.math"))
    if (part.scrollWidth > part.clientWidth) part.tabIndex = 0;
});
