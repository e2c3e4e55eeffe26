// The page of a file.

show(document.body, bytesOf(document.getElementById("payload").textContent), document.documentElement);
