// Builds a tree with three-mesh-bvh (SAH) and prints its cost by AccelScope's definition, as JSON.
//
//     node build.mjs TRIANGLES LEAF
//
// TRIANGLES is a file of little-endian f32, nine for each triangle. LEAF says when a node is a leaf:
// "single" with one triangle, "cost" where no split is cheaper, a number with at most so many.
// The costs of a step and of a triangle are constants of three-mesh-bvh: 1 and 1.25.

import { readFileSync } from 'node:fs';
import { BufferAttribute, BufferGeometry } from 'three';
import { MeshBVH, SAH } from 'three-mesh-bvh';

const C_TRAV = 1;
const C_ISECT = 1.25;

const [ file, leaf ] = process.argv.slice( 2 );
const bytes = readFileSync( file );
const positions = new Float32Array( bytes.buffer, bytes.byteOffset, bytes.length / 4 );
const geometry = new BufferGeometry();
geometry.setAttribute( 'position', new BufferAttribute( positions, 3 ) );

const options = { strategy: SAH, maxDepth: 200, targetLeafSize: Number( leaf ) || 1 };
if ( leaf === 'single' ) options._strictLeafSize = 1;

const start = performance.now();
const bvh = new MeshBVH( geometry, options );
const seconds = ( performance.now() - start ) / 1000;

function areaOf( box ) {

	const [ x, y, z ] = [ box[ 3 ] - box[ 0 ], box[ 4 ] - box[ 1 ], box[ 5 ] - box[ 2 ] ];
	return x * y + y * z + z * x;

}

const figures = { N_IN: 0, N_V: 0, N_OIV: 0, largest_leaf: 0 };
let root = 0;
let innerArea = 0;
let leafArea = 0;
bvh.traverse( ( depth, isLeaf, box, offset, count ) => {

	const area = areaOf( box );
	if ( depth === 0 ) root = area;
	if ( isLeaf ) {

		figures.N_V ++;
		figures.N_OIV += count;
		figures.largest_leaf = Math.max( figures.largest_leaf, count );
		leafArea += count * area;

	} else {

		figures.N_IN ++;
		innerArea += area;

	}

} );
const sah = ( C_TRAV * innerArea + C_ISECT * leafArea ) / root;
console.log( JSON.stringify( { sah, ...figures, seconds } ) );
