import { useEffect, useState } from "react";
import { createRoot } from "react-dom/client";
import { Canvas, useFrame } from "@react-three/fiber";
import { ArLayer, ArSession } from "oaslam/three";

function Layer({ layer, children }) {
  useFrame(({ camera, gl }) => layer.update(camera, gl.domElement));
  return <primitive object={layer}>{children}</primitive>;
}

function App({ layer }) {
  const [hits, setHits] = useState([]);
  useEffect(() => layer.addEventListener("restart", () => setHits([])), [layer]);
  const tap = ({ nativeEvent: { offsetX, offsetY } }) => setHits([...hits, layer.hit(offsetX, offsetY)].filter(Boolean));
  const cubes = hits.map((hit, i) => <mesh key={i} position={hit.position} scale={0.1 * hit.distance}><boxGeometry /><meshBasicMaterial color="deeppink" /></mesh>);
  return <Canvas flat onClick={tap}><Layer layer={layer}>{cubes}</Layer></Canvas>;
}

const root = document.querySelector("#root");
async function start() {
  createRoot(root).render(<App layer={new ArLayer(await ArSession.start())} />);
}
root.addEventListener("click", () => start().catch((error) => (root.textContent = error.message)), { once: true });
