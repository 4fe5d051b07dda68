// What the viewer uses of three.js; three.min.js says how it is made of this.
export {
  AmbientLight, BufferAttribute, BufferGeometry, CanvasTexture, Color, DataTexture, DirectionalLight, DoubleSide, FloatType, Fog,
  GLSL3, HemisphereLight, InstancedBufferAttribute, InstancedBufferGeometry, Line, LineBasicMaterial, Matrix4, Mesh, MeshBasicMaterial, MeshStandardMaterial,
  PerspectiveCamera, Plane, PlaneGeometry, RGBAFormat, Raycaster, RepeatWrapping, Scene, ShaderMaterial, SRGBColorSpace,
  TextureLoader, Vector2, Vector3, WebGLRenderer,
} from 'three'
export { OrbitControls } from 'three/addons/controls/OrbitControls.js'
