// What to do where the browser does not give the camera.

// What is wrong, and the steps to mend it, from what the browser offers and what getUserMedia threw; null where nothing is.
export function refusal({ isSecure, hasCamera, hasGraphics, error, address }) {
  if (!isSecure || !hasCamera)
    return {
      title: "The camera needs a secure address",
      steps: [
        "Browsers give the camera only to pages over HTTPS. This page came without it.",
        `Open ${address.replace(/^http:/, "https:")}`,
        "If that does not answer, start the server with a certificate: oaslam serve --maps FOLDER --bind 0.0.0.0 --tls-self-signed --token-file FILE. It prints the address to open.",
        "A certificate that the server made itself is unknown to the browser, which warns once: choose to go on (Advanced, Proceed; on an iPhone: Show Details, visit this website).",
      ],
    };
  if (!hasGraphics) return { title: "No graphics", steps: ["This page draws with WebGL 2, which this browser does not have or has switched off. A newer browser has it."] };
  if (!error) return null;
  const again = "Then load this page again.";
  switch (error.name) {
    case "NotAllowedError":
    case "SecurityError":
      return {
        title: "The camera is not allowed",
        steps: [
          "Chrome, Android: touch the sign left of the address, Permissions, and allow the camera.",
          "Safari, iPhone: touch the sign left of the address, Website Settings, Camera: Allow. If it is not offered: Settings, Apps, Safari, Camera.",
          "Firefox: touch the lock beside the address, and clear the permission that was denied.",
          again,
        ],
      };
    case "NotFoundError":
    case "OverconstrainedError":
      return { title: "There is no camera", steps: ["This device has no camera that the browser knows. Open the address on a phone:", address, "With a camera that was plugged in just now: load this page again."] };
    case "NotReadableError":
    case "AbortError":
      return { title: "The camera is in use", steps: ["Another program has it. Close that one.", again] };
    default:
      return { title: "The camera does not start", steps: [`The browser says: ${error.message || error.name}`, again] };
  }
}
