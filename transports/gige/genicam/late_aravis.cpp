// SPDX-License-Identifier: Apache-2.0
// Lazily loaded stub of Aravis: the functions that the GenICam engine calls, as in images/late_cfitsio.cpp.
// Only the description of another camera (`gige.xml`) needs the engine. Without one, nine libraries are not
// loaded, nor 30 MB of their character tables, which would be locked in memory.
#include "core/io/late_library.hpp"

#include <arv.h>

namespace {

template<typename Function>
Function* late(Function* like, const char* name) {
    static const obscura::LateLibrary aravis(OBSCURA_ARAVIS, "gige.xml");
    return aravis.find(like, name);
}

} // namespace

extern "C" {
GQuark arv_device_error_quark() {
    static auto* const call = late(&arv_device_error_quark, "arv_device_error_quark");
    return call();
}

GType arv_device_get_type() {
    static auto* const call = late(&arv_device_get_type, "arv_device_get_type");
    return call();
}

const char* arv_dom_character_data_get_data(ArvDomCharacterData* self) {
    static auto* const call = late(&arv_dom_character_data_get_data, "arv_dom_character_data_get_data");
    return call(self);
}

GType arv_dom_character_data_get_type() {
    static auto* const call = late(&arv_dom_character_data_get_type, "arv_dom_character_data_get_type");
    return call();
}

GType arv_dom_element_get_type() {
    static auto* const call = late(&arv_dom_element_get_type, "arv_dom_element_get_type");
    return call();
}

ArvDomNode* arv_dom_node_get_first_child(ArvDomNode* self) {
    static auto* const call = late(&arv_dom_node_get_first_child, "arv_dom_node_get_first_child");
    return call(self);
}

ArvDomNode* arv_dom_node_get_next_sibling(ArvDomNode* self) {
    static auto* const call = late(&arv_dom_node_get_next_sibling, "arv_dom_node_get_next_sibling");
    return call(self);
}

const char* arv_dom_node_get_node_name(ArvDomNode* self) {
    static auto* const call = late(&arv_dom_node_get_node_name, "arv_dom_node_get_node_name");
    return call(self);
}

GType arv_dom_node_get_type() {
    static auto* const call = late(&arv_dom_node_get_type, "arv_dom_node_get_type");
    return call();
}

GType arv_gc_boolean_get_type() {
    static auto* const call = late(&arv_gc_boolean_get_type, "arv_gc_boolean_get_type");
    return call();
}

gboolean arv_gc_boolean_get_value(ArvGcBoolean* gc_boolean, GError** error) {
    static auto* const call = late(&arv_gc_boolean_get_value, "arv_gc_boolean_get_value");
    return call(gc_boolean, error);
}

void arv_gc_boolean_set_value(ArvGcBoolean* gc_boolean, gboolean v_boolean, GError** error) {
    static auto* const call = late(&arv_gc_boolean_set_value, "arv_gc_boolean_set_value");
    call(gc_boolean, v_boolean, error);
}

void arv_gc_command_execute(ArvGcCommand* gc_command, GError** error) {
    static auto* const call = late(&arv_gc_command_execute, "arv_gc_command_execute");
    call(gc_command, error);
}

GType arv_gc_command_get_type() {
    static auto* const call = late(&arv_gc_command_get_type, "arv_gc_command_get_type");
    return call();
}

const char* arv_gc_enumeration_get_string_value(ArvGcEnumeration* enumeration, GError** error) {
    static auto* const call =
        late(&arv_gc_enumeration_get_string_value, "arv_gc_enumeration_get_string_value");
    return call(enumeration, error);
}

GType arv_gc_enumeration_get_type() {
    static auto* const call = late(&arv_gc_enumeration_get_type, "arv_gc_enumeration_get_type");
    return call();
}

gboolean arv_gc_enumeration_set_string_value(ArvGcEnumeration* enumeration, const char* value,
                                             GError** error) {
    static auto* const call =
        late(&arv_gc_enumeration_set_string_value, "arv_gc_enumeration_set_string_value");
    return call(enumeration, value, error);
}

const char* arv_gc_feature_node_get_name(ArvGcFeatureNode* gc_feature_node) {
    static auto* const call = late(&arv_gc_feature_node_get_name, "arv_gc_feature_node_get_name");
    return call(gc_feature_node);
}

GType arv_gc_feature_node_get_type() {
    static auto* const call = late(&arv_gc_feature_node_get_type, "arv_gc_feature_node_get_type");
    return call();
}

GType arv_gc_float_get_type() {
    static auto* const call = late(&arv_gc_float_get_type, "arv_gc_float_get_type");
    return call();
}

double arv_gc_float_get_value(ArvGcFloat* gc_float, GError** error) {
    static auto* const call = late(&arv_gc_float_get_value, "arv_gc_float_get_value");
    return call(gc_float, error);
}

void arv_gc_float_set_value(ArvGcFloat* gc_float, double value, GError** error) {
    static auto* const call = late(&arv_gc_float_set_value, "arv_gc_float_set_value");
    call(gc_float, value, error);
}

ArvGcNode* arv_gc_get_node(ArvGc* genicam, const char* name) {
    static auto* const call = late(&arv_gc_get_node, "arv_gc_get_node");
    return call(genicam, name);
}

GType arv_gc_integer_get_type() {
    static auto* const call = late(&arv_gc_integer_get_type, "arv_gc_integer_get_type");
    return call();
}

gint64 arv_gc_integer_get_value(ArvGcInteger* gc_integer, GError** error) {
    static auto* const call = late(&arv_gc_integer_get_value, "arv_gc_integer_get_value");
    return call(gc_integer, error);
}

void arv_gc_integer_set_value(ArvGcInteger* gc_integer, gint64 value, GError** error) {
    static auto* const call = late(&arv_gc_integer_set_value, "arv_gc_integer_set_value");
    call(gc_integer, value, error);
}

ArvGc* arv_gc_new(ArvDevice* device, const void* xml, size_t size) {
    static auto* const call = late(&arv_gc_new, "arv_gc_new");
    return call(device, xml, size);
}

guint64 arv_gc_register_get_address(ArvGcRegister* gc_register, GError** error) {
    static auto* const call = late(&arv_gc_register_get_address, "arv_gc_register_get_address");
    return call(gc_register, error);
}

guint64 arv_gc_register_get_length(ArvGcRegister* gc_register, GError** error) {
    static auto* const call = late(&arv_gc_register_get_length, "arv_gc_register_get_length");
    return call(gc_register, error);
}

GType arv_gc_register_get_type() {
    static auto* const call = late(&arv_gc_register_get_type, "arv_gc_register_get_type");
    return call();
}

GType arv_gc_string_get_type() {
    static auto* const call = late(&arv_gc_string_get_type, "arv_gc_string_get_type");
    return call();
}

const char* arv_gc_string_get_value(ArvGcString* gc_string, GError** error) {
    static auto* const call = late(&arv_gc_string_get_value, "arv_gc_string_get_value");
    return call(gc_string, error);
}

void arv_gc_string_set_value(ArvGcString* gc_string, const char* value, GError** error) {
    static auto* const call = late(&arv_gc_string_set_value, "arv_gc_string_set_value");
    call(gc_string, value, error);
}
} // extern "C"
